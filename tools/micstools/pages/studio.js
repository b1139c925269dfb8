'use strict';
// Edits a case: hands each change to the server, which has the text and asks the program, and shows
// what that says beside the fields. In a flat view a block is dragged to its place.

const TYPING = 350; // from the last letter to the change [ms]

class Studio {
  constructor(player) {
    this.player = player;
    this.form = document.getElementById('form');
    this.text = document.getElementById('text');
    this.checking = this.again = false;
    this.wrong = ''; // why the last change was not made
    this.pending = new Set(); // fields whose change has not been sent yet
    this.form.addEventListener('input', event => this.later(event.target));
    this.form.addEventListener('change', event => this.later(event.target, 0));
    this.form.addEventListener('submit', event => event.preventDefault());
    this.text.addEventListener('input', () => this.later(this.text));
    this.tasks = document.getElementById('new');
    this.tasks.addEventListener('change', () => this.begin());
    document.addEventListener('click', event => this.click(event));
    if (player) player.stage.grab = new Grab(player.stage, (body, by) => {
      this.flush();
      if (this.checking) tell('not moved: wait for the check');
      else this.edit({ op: 'move', body, by });
    });
    this.inLine(() => this.start());
  }

  async start() {
    this.take(await ask('draft'));
    this.rebuild();
    this.check();
  }

  // The form anew: groups came or went.
  rebuild() {
    const open = new Map([...this.form.querySelectorAll('details')].map((d, k) => [k, d.open]));
    this.form.replaceChildren(new Form(read('schema'), document.getElementById('physics').content.cloneNode(true)).build(this.values));
    const all = [...this.form.querySelectorAll('details')];
    if (open.size === all.length) all.forEach((d, k) => { d.open = open.get(k); });
  }

  later(field, wait = TYPING) {
    this.pending.add(field);
    field.made = this.groups;
    document.getElementById('save').disabled = false;
    clearTimeout(field.waiting);
    field.waiting = setTimeout(() => this.send(field), wait);
  }

  // The case of a task in place of this text; Undo brings that back.
  async begin() {
    const task = this.tasks.value;
    this.tasks.value = '';
    if (task === '') return;
    this.flush();
    this.fresh = true;
    await this.edit({ op: 'new', ...JSON.parse(task) });
  }

  // Sends at once what would be sent later.
  flush() {
    for (const field of this.pending) {
      clearTimeout(field.waiting);
      this.send(field);
    }
  }

  send(field) {
    this.pending.delete(field);
    if (field === this.text) return this.edit({ op: 'text', text: field.value }, field);
    const { group, n, variable } = field.dataset;
    if (!variable || field.sent === field.value) return null;
    field.sent = field.value;
    return this.edit({ op: 'set', group, n: +n, variable, value: field.value }, field);
  }

  // Changes, Save and Run are sent one after another: an answer may not come after a later one.
  inLine(work) {
    return this.line = (this.line || Promise.resolve()).then(work).catch(problem => tell(problem.message));
  }

  // A change of a field counts for the groups and the text that it was made for.
  edit(order, field) {
    const { given } = this;
    return this.inLine(async () => {
      if (field && given !== this.given) return;
      try {
        const was = this.groups;
        if (order.op === 'set' && field.made !== was) throw new Error(`not changed: ${order.variable}, for the groups are others now`);
        const state = await this.post('edit', order);
        this.take(state);
        if (order.op !== 'set' && order.op !== 'move' || was !== this.groups) this.rebuild();
        tell('');
      } catch (problem) {
        this.wrong = problem.message;
        if (field && field.isConnected && !problem.theirs) { // Save and Run try again
          field.sent = undefined;
          this.pending.add(field);
        }
        tell(problem.message);
      }
      this.check();
    });
  }

  // Asks for something that is based on the text of this page. Where another window has changed that,
  // the text of either is taken.
  async post(path, order) {
    for (;;) try {
      return await ask(path, { ...order, number: this.number });
    } catch (problem) {
      const { state } = problem.said || {};
      if (!state) throw problem;
      if (await this.choose() !== 'mine') {
        document.activeElement.blur();
        for (const field of this.pending) clearTimeout(field.waiting);
        this.pending.clear();
        this.given = {}; // what is in line is of the text that was given up
        this.take(state);
        this.rebuild();
        this.check();
        throw Object.assign(new Error('the text of the other window is shown'), { theirs: true });
      }
      this.number = state.number;
      this.number = (await this.post('edit', { op: 'text', text: this.shown })).number;
    }
  }

  choose() {
    const dialog = document.getElementById('stale');
    dialog.returnValue = '';
    dialog.onclick = event => { if (event.target.value) dialog.close(event.target.value); };
    dialog.showModal();
    return new Promise(done => { dialog.onclose = () => done(dialog.returnValue); });
  }

  // The text and the values of the case; a field that one is in, or has changed since, stays as it is.
  take({ text, values, saved, undo, number }) {
    const here = document.activeElement, free = field => field !== here && !this.pending.has(field);
    Object.assign(this, { number, values, shown: text });
    this.groups = values.map(({ group, n }) => `${group}.${n}`).join();
    if (free(this.text)) this.text.value = text;
    for (const { group, n, values: said } of values) for (const [name, value] of Object.entries(said || {})) {
      const field = document.getElementById(`${group}-${n}-${name}`);
      if (field && free(field) && field.value !== value) field.value = field.sent = value;
    }
    document.getElementById('undo').disabled = !undo;
    document.getElementById('save').disabled = saved && !this.pending.size;
  }

  // Asks the program, one question at a time: of changes that come meanwhile the last one counts.
  async check() {
    const verdict = document.getElementById('verdict');
    verdict.textContent = 'Checking …';
    verdict.className = 'note';
    this.again = true;
    if (this.checking) return;
    this.checking = true;
    let said;
    while (this.again) {
      this.again = false;
      said = await ask('check').catch(problem => ({ problems: [{ text: problem.message }], warnings: 0 }));
    }
    this.checking = false;
    this.tellVerdict(said, verdict);
  }

  tellVerdict(said, verdict) {
    const n = said.problems.length, w = said.warnings;
    verdict.textContent = n ? `Refused: ${n === 1 ? 'one problem' : `${n} problems`}.`
      : `Accepted${w ? `, with ${w === 1 ? 'one warning' : `${w} warnings`}` : ''}.`;
    verdict.className = n ? 'look' : 'good';
    document.querySelectorAll('#run, #repeats').forEach(b => { b.disabled = n > 0; });
    document.querySelector('.seen').classList.toggle('old', n > 0);
    document.getElementById('older').hidden = !n || !this.accepted;
    this.mark(said.problems);
    if (n) return;
    this.accepted = true;
    putParts(said.parts);
    if (!this.player) return;
    const keep = Boolean(this.player.stage.scene) && !this.fresh, time = keep ? this.player.stage.time : 0;
    this.fresh = false;
    this.player.stage.grab.body = null; // of another scene
    this.player.load(said.scene, keep);
    this.player.show(time);
  }

  // Each problem at its field, or at its group, and all in a list that leads there.
  mark(problems) {
    this.form.querySelectorAll('.wrong').forEach(place => { place.textContent = ''; });
    this.form.querySelectorAll('[aria-invalid]').forEach(field => field.removeAttribute('aria-invalid'));
    const list = problems.map(({ text, short, group, variable, occurrence: n, line }) => {
      const key = `${group}-${n}-${variable}`, field = document.getElementById(key);
      const place = document.getElementById(`${key}-wrong`) || this.form.querySelector(`[data-of="${group}.${n}"]`);
      if (place) place.textContent = [place.textContent, short].filter(Boolean).join('; ');
      if (field) {
        field.setAttribute('aria-invalid', 'true');
        for (let box = field.closest('details'); box; box = box.parentElement.closest('details')) box.open = true;
      }
      const item = document.createElement('li'), button = document.createElement('button');
      button.type = 'button';
      button.textContent = '!';
      button.setAttribute('aria-label', `go to: ${text}`);
      button.addEventListener('click', () => (field || place || this.text).scrollIntoView({ block: 'center' }) || (field && field.focus()));
      const words = document.createElement('span');
      words.textContent = text;
      if (line || group && this.lineOf(group, variable)) {
        const there = document.createElement('button');
        Object.assign(there, { type: 'button', className: 'line', textContent: `line ${this.lineOf(group, variable, line)}` });
        there.addEventListener('click', () => this.goTo(this.lineOf(group, variable, line)));
        words.append(there);
      }
      item.append(button, words);
      return item;
    });
    document.getElementById('problems').replaceChildren(...list);
  }

  async click(event) {
    const button = event.target.closest('button');
    if (!button) return;
    const { add, copy, remove, n, show } = button.dataset;
    if (copy || remove) event.preventDefault(); // stands in a summary, which would close
    this.wrong = '';
    this.flush();
    if (add) await this.edit({ op: 'add', group: add });
    if (copy) await this.edit({ op: 'copy', group: copy, n: +n });
    if (remove) await this.edit({ op: 'remove', group: remove, n: +n });
    if (show) this.show(show);
    if (button.dataset.line) this.goTo(+button.dataset.line);
    if (button.id === 'undo') await this.edit({ op: 'undo' });
    if (['save', 'run', 'repeat'].includes(button.id)) await this.order(button.id);
    if (button.id === 'repeats') document.getElementById('many').showModal();
    if (button.matches('.close')) button.closest('dialog').close();
  }

  show(name) {
    this.form.hidden = name !== 'form';
    this.text.hidden = name !== 'text';
    document.querySelectorAll('[data-show]').forEach(b => b.setAttribute('aria-pressed', b.dataset.show === name));
  }

  // The line of a variable in its group, which the program says the line of; else that of the group.
  lineOf(group, variable, line) {
    const lines = this.text.value.split('\n'), begin = new RegExp(`^\\s*&${group}\\b`, 'i');
    const first = line ? line - 1 : lines.findIndex(words => begin.test(words)), named = new RegExp(`^[^!]*\\b${variable}\\b[^!=]*=`, 'i');
    for (let k = Math.max(first, 0); variable && k < lines.length && (k === first || !/^\s*&/.test(lines[k])); k++)
      if (named.test(lines[k])) return k + 1;
    return first + 1;
  }

  // Shows a line of the text.
  goTo(line) {
    this.show('text');
    const { text } = this;
    text.focus();
    text.setSelectionRange(...ends(text.value, line));
    text.scrollTop = (line - 1) / text.value.split('\n').length * text.scrollHeight - text.clientHeight / 2;
    text.scrollIntoView({ block: 'nearest' });
  }

  // Saves or runs, once all changes have arrived.
  async order(path) {
    await this.line;
    const [threads, runs, spread] = ['threads', 'runs', 'spread'].map(id => document.getElementById(id));
    const used = { save: [], run: [threads], repeat: [threads, runs, spread] }[path];
    const bad = used.find(field => !field.checkValidity()), { wrong } = this;
    if (bad !== runs && bad !== spread) document.getElementById('many').close();
    if (bad) return bad.reportValidity();
    if (wrong) return tell(wrong);
    tell('…');
    await this.inLine(async () => {
      const { told, open } = await this.post(path, { threads: threads.value, runs: runs.value, spread: spread.value });
      tell(told);
      if (open) location.assign(open);
      else this.take(await ask('draft'));
    });
  }
}

// A block that is dragged in a flat view.
class Grab {
  constructor(stage, done) {
    this.stage = stage;
    this.done = done;
    this.body = null;
  }

  // Takes the block under the mouse, the nearest of several; true if there is one.
  press(clientX, clientY) {
    const { stage } = this, p = stage.under(clientX, clientY), { right, up, away } = stage.axes;
    let found = null, nearest = -Infinity;
    stage.scene.bodies.forEach((body, k) => {
      const { place } = stage.pose(k), d = place.map((v, i) => v - p[i]);
      const far = Math.hypot(dot(d, right), dot(d, up)), near = dot(place, away);
      if (far < 0.7 * stage.meshes[body.shape].radius && near > nearest) [found, nearest] = [k, near];
    });
    if (found === null) return false;
    Object.assign(this, { body: found, from: p, by: [0, 0, 0], was: stage.place.slice() });
    return true;
  }

  move(clientX, clientY) {
    if (this.body === null) return false;
    const { stage } = this, n = stage.scene.bodies.length;
    this.by = stage.under(clientX, clientY).map((v, i) => v - this.from[i]);
    for (let a = 0; a < stage.times.length; a++) for (let i = 0; i < 3; i++) {
      const k = 3 * (a * n + this.body) + i;
      stage.place[k] = this.was[k] + this.by[i];
    }
    stage.draw();
    return true;
  }

  release() {
    if (this.body === null) return;
    const { body, by } = this;
    this.body = null;
    if (Math.hypot(...by) > 1e-9) this.done(body, by);
  }
}

const startStudio = () => new Studio(startPlan(document.getElementById('player')));
