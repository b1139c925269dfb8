'use strict';
// The buttons around a stage. Names of elements are classes inside `root`.
class Player {
  constructor(root) {
    const part = name => root.querySelector('.' + name);
    this.root = root;
    this.stage = new Stage(part('stage'), part('over'));
    this.slider = part('slider');
    this.button = part('play');
    this.clock = part('clock');
    this.pace = part('pace');
    this.legend = part('legend');
    this.playing = false;
    this.follow = part('follow');
    const stage = this.stage;
    this.button.addEventListener('click', () => this.toggle());
    this.slider.addEventListener('input', () => { this.pause(); this.show(+this.slider.value); });
    part('colouring').addEventListener('change', event => {
      stage.colouring = event.target.value;
      this.explain();
      stage.draw();
    });
    this.follow.addEventListener('change', event => {
      stage.followed = event.target.value === '' ? null : +event.target.value;
      stage.offset = [0, 0, 0];
      stage.distance = stage.followed === null ? null : 0.45 * stage.fit;
      stage.draw();
    });
    this.wet = part('wet');
    this.wet.addEventListener('change', event => { stage.wet = event.target.value; this.explain(); stage.draw(); });
    for (const name of ['numbers', 'paths'])
      part(name).addEventListener('change', event => { stage.overlay[name] = event.target.checked; stage.draw(); });
    root.querySelectorAll('[data-view]').forEach(b => b.addEventListener('click', () => stage.view(b.dataset.view)));
    root.querySelectorAll('[data-zoom]').forEach(b => b.addEventListener('click', () => stage.zoom(+b.dataset.zoom)));
    stage.canvas.addEventListener('keydown', event => {
      if (event.key !== ' ' || this.still) return;
      event.preventDefault();
      this.toggle();
    });
  }

  // `keep`: the view, who is followed and the pace, if it is offered again, stay.
  load(scene, keep = false) {
    const pace = this.pace.value, followed = this.follow.value;
    this.pause();
    this.stage.load(scene, keep);
    const times = this.stage.times;
    [this.slider.min, this.slider.max] = [times[0], times[times.length - 1]];
    this.slider.step = 'any';
    this.still = times.length < 2;
    this.root.classList.toggle('still', this.still);
    this.follow.replaceChildren(new Option('whole tank', ''), ...scene.bodies
      .map((body, k) => [body, k]).filter(([body]) => !body.fixed && body.release !== null)
      .map(([body, k]) => new Option(Number.isInteger(body.number) ? `block ${body.number}` : body.number, k)));
    this.wet.closest('label').hidden = !scene.water;
    this.wet.querySelector('[value=speed]').hidden = !(scene.water && scene.water.speed);
    if (this.stage.wet === 'speed' && !(scene.water && scene.water.speed)) this.wet.value = this.stage.wet = 'clear';
    if (keep) this.follow.value = followed;
    this.offerPaces(times[times.length - 1] - times[0]);
    if (keep && [...this.pace.options].some(option => option.value === pace)) this.pace.value = pace;
    this.explain();
    this.show(times[0]);
  }

  // Paces up to the one that shows the whole run in 10 s; at first a run takes some 30 s, or half its pace.
  offerPaces(length) {
    const whole = length / 10, usual = [0.1, 0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
    const words = pace => pace < 1 ? `1/${1 / pace}` : `${+pace.toPrecision(2)}`;
    const paces = usual.filter(pace => pace <= 1 || pace < 0.95 * whole);
    if (whole > 1) paces.push(whole);
    this.pace.replaceChildren(...paces.map(pace =>
      new Option(words(pace) + (pace === whole ? ', all in 10 s' : ''), pace)));
    this.pace.value = paces.find(pace => pace >= Math.max(0.5, length / 40)) || paces[paces.length - 1];
  }

  show(time) {
    this.stage.set(time);
    this.slider.value = this.stage.time;
    this.clock.textContent = this.stage.time.toFixed(this.stage.times[this.stage.times.length - 1] < 2 ? 4 : 2) + ' s';
    this.slider.setAttribute('aria-valuetext', this.clock.textContent);
    if (!this.still) moveMarks(this.stage.time);
  }

  toggle() { if (this.playing) this.pause(); else this.play(); }

  play() {
    const end = this.stage.times[this.stage.times.length - 1];
    if (this.stage.time >= end) this.show(this.stage.times[0]);
    this.playing = true;
    this.button.textContent = 'Pause';
    let last = performance.now();
    const step = now => {
      this.show(this.stage.time + (now - last) / 1000 * +this.pace.value);
      last = now;
      if (this.stage.time >= end) this.pause(); else this.frame = requestAnimationFrame(step);
    };
    this.frame = requestAnimationFrame(step);
  }

  pause() {
    cancelAnimationFrame(this.frame);
    this.playing = false;
    this.button.textContent = 'Play';
  }

  // What the colours mean.
  explain() {
    const { colouring, scene, wet } = this.stage;
    const entry = (colour, words) => {
      const item = document.createElement('li'), box = document.createElement('i');
      if (colour) box.style.background = colour; else box.hidden = true;
      item.append(box, words);
      return item;
    };
    const speeds = (name, fastest) => [entry('', name), ...[0, 0.04, 0.16, 0.36, 0.64, 1].map(s =>
      entry(css(ramp(Math.sqrt(s))), (s * fastest).toPrecision(2) + ' m/s'))];
    const entries = { block: [], speed: speeds('blocks:', scene.fastest),
      contacts: [0, 1, 2, 3, 4, 5].map(n => entry(css(ramp(n / 5)), n < 5 ? `touches ${n}` : '5 or more')) };
    const water = wet === 'speed' && scene.water && scene.water.speed;
    this.legend.replaceChildren(...entries[colouring], ...water ? speeds('water:', water.fastest) : []);
  }
}

// The marks in the charts that stand where the player is.
function moveMarks(time) {
  for (const mark of document.querySelectorAll('.now')) {
    const { left, right, from, to } = mark.dataset;
    const x = +left + (time - from) / (to - from) * (right - left);
    mark.setAttribute('x1', x);
    mark.setAttribute('x2', x);
    mark.removeAttribute('hidden');
  }
}

// A player, or the word that there can be none.
function startPlayer(root) {
  try {
    return new Player(root);
  } catch (problem) {
    root.classList.add('without');
    return null;
  }
}
const read = name => JSON.parse(document.getElementById(name).textContent);
