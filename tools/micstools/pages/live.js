'use strict';
// Keeps a page up to date with what goes on: asks the server that the page came from, puts the parts
// in their places, shows the motion so far, and hands on what the buttons ask for.

const OFTEN = 1000, SELDOM = 4000; // between two looks, while it runs and else [ms]
const PATIENCE = 4; // a look that takes long is not repeated before so many times that

async function ask(path, body) {
  const token = document.querySelector('meta[name=mics-token]').content;
  const how = body === undefined ? {} : { method: 'POST', body: JSON.stringify(body),
    headers: { 'Content-Type': 'application/json', 'X-Mics-Token': token } };
  const answer = await fetch(path, how);
  const said = answer.headers.get('Content-Type').includes('json') ? await answer.json() : { error: await answer.text() };
  if (!answer.ok) throw Object.assign(new Error(said.error || answer.statusText), { said });
  return said;
}

const tell = words => { document.getElementById('told').textContent = words; };

// Markup of the server in its place, if it is another one than before.
function putParts(parts) {
  for (const [name, text] of Object.entries(parts)) {
    const place = document.querySelector(`[data-live=${name}]`);
    if (!place || place.was === text || place.matches(':active')) continue; // a button is being pressed
    place.was = place.innerHTML = text;
  }
}

class Live {
  constructor(player) {
    this.player = player;
    this.chosen = ''; // run of an ensemble
    document.addEventListener('click', event => this.click(event.target.closest('button')));
    document.addEventListener('visibilitychange', () => { if (!document.hidden) this.soon(0); });
    this.soon(0);
  }

  soon(wait) {
    clearTimeout(this.next);
    this.next = setTimeout(() => this.look(), wait);
  }

  async look() {
    this.wanted = this.busy; // another look after this one
    if (document.hidden || this.busy) return;
    this.busy = true;
    const began = performance.now();
    let often = false;
    try {
      const { parts, running, key, of } = await ask('live');
      if (this.of && this.of !== of) location.reload(); // another run is watched from here now
      this.of = of;
      often = running;
      putParts(parts);
      document.querySelectorAll('main > .row [data-stop], [data-ask]').forEach(b => { b.disabled = !running; });
      document.querySelectorAll('#go-on, #pdf, #places').forEach(b => { b.disabled = running || !key; });
      if (this.key !== `${this.chosen} ${key}`) await this.showScene(`${this.chosen} ${key}`);
      if (this.player && this.player.stage.scene) moveMarks(this.player.stage.time);
      if (this.lost) tell('');
      this.lost = false;
    } catch (problem) {
      this.lost = true;
      tell(`no answer: ${problem.message}`);
    }
    this.busy = false;
    this.soon(this.wanted ? 0 : Math.max(often ? OFTEN : SELDOM, PATIENCE * (performance.now() - began)));
  }

  // The motion so far; who stands at its end stays there.
  async showScene(key) {
    const { player, chosen } = this, scene = player && await ask(chosen ? `scene?run=${chosen}` : 'scene');
    if (chosen !== this.chosen) return;
    this.key = key;
    if (!scene) return;
    player.root.hidden = !scene.bodies;
    if (!scene.bodies) return;
    const stage = player.stage, same = stage.scene && this.loaded === chosen;
    const at = same ? stage.time : null, atEnd = !same || at >= stage.times[stage.times.length - 1];
    const playing = player.playing;
    player.load(scene, same);
    this.loaded = chosen;
    player.show(atEnd ? stage.times[stage.times.length - 1] : at);
    if (playing && !atEnd) player.play();
  }

  async click(button) {
    if (!button) return;
    const { run, stop, ask: dialog } = button.dataset;
    if (dialog) document.getElementById(dialog).showModal();
    if (stop || button.matches('.close')) button.closest('dialog')?.close();
    if (run) { this.chosen = run; this.soon(0); }
    if (stop) await this.order('stop', { how: stop });
    if (['report', 'go-on', 'pdf', 'places'].includes(button.id)) await this.order(button.id, {});
  }

  // Asks for something, tells the answer, opens the page that it names.
  async order(path, body) {
    tell('…');
    try {
      const { told, open } = await ask(path, body);
      tell(told);
      if (open) location.assign(open);
      this.soon(0);
    } catch (problem) {
      tell(problem.message);
    }
  }
}

const startLive = () => new Live(startPlayer(document.getElementById('player')));
