// What helps a driver: a table of aids, each switched by its key or by touch, and remembered.
//
// An aid draws with what `Aids.draw` hands it: the screen, the state, and a sketch that takes
// rays. It knows no pixels of its own, so that whatever shows rays can show the aids: a canvas
// today, the two eyes of a headset another day.

import { say } from '/buttons.js';
import { edges } from '/edges.js';
import { ground, lackOfGround } from '/ground.js';
import { heading } from '/heading.js';
import { rear } from '/rear.js';
import { setup } from '/setup.js';
import { Sketch } from '/sketch.js';
import { store } from '/store.js';

const $ = (id) => document.getElementById(id);
const KEY = 'aids';
const AT_FIRST = 'heading';

/**
 * Each aid: its name, words and key; `draw`, if it draws anything; `lack`, a sentence if the
 * state does not hold what it needs. CSS finds the names of those that are on in `data-aids`.
 */
const AIDS = [
  { name: 'heading', words: 'Heading', key: 'h', draw: heading },
  { name: 'ground', words: 'Path', key: 'g', draw: ground, lack: lackOfGround },
  { name: 'rear', words: 'Rear view', key: 'r', draw: rear },
  { name: 'edges', words: 'Degrees', key: 'd', draw: edges },
  { name: 'setup', words: 'Seams', key: 'm', draw: setup },
  { name: 'sunlight', words: 'Sunlight', key: 'l' },
];

export class Aids {
  constructor(screen) {
    this.screen = screen;
    this.state = {};
    this.sketch = new Sketch($('sketch'));
    this.store = store('localStorage');
    this.on = new Set((this.store.getItem(KEY) ?? AT_FIRST).split(' '));
    this.buttons = new Map(AIDS.map((aid) => [aid.name, this.button(aid)]));
    $('aids').replaceChildren(...this.buttons.values());
    $('help').addEventListener('click', () => {
      $('aids').hidden = !$('aids').hidden;
      $('help').setAttribute('aria-expanded', !$('aids').hidden);
    });
    this.show();
  }

  /** What each key does. */
  get keys() {
    return Object.fromEntries([
      ['a', () => $('help').click()],
      ...AIDS.map((aid) => [aid.key, () => this.toggle(aid)]),
    ]);
  }

  button(aid) {
    const button = document.createElement('button');
    button.title = `${aid.words} (${aid.key.toUpperCase()})`;
    button.append(aid.words, document.createElement('kbd'));
    button.lastChild.textContent = aid.key.toUpperCase();
    button.addEventListener('click', () => this.toggle(aid));
    return button;
  }

  toggle(aid) {
    if (!this.on.delete(aid.name)) this.on.add(aid.name);
    this.store.setItem(KEY, [...this.on].join(' '));
    const lack = this.on.has(aid.name) && aid.lack?.(this.state);
    if (lack) say(lack);
    this.show();
    this.screen.arrange();
  }

  show() {
    document.body.dataset.aids = [...this.on].join(' ');
    for (const [name, button] of this.buttons) {
      button.setAttribute('aria-pressed', this.on.has(name));
    }
  }

  /** Take what the viewer knows: robot, overlaps. */
  take(state) {
    this.state = state;
    this.screen.redraw();
  }

  draw() {
    const { screen, sketch, state } = this;
    sketch.begin((ray) => screen.locate(ray), screen.mode === 'whole');
    for (const aid of AIDS) {
      try {
        if (this.on.has(aid.name)) aid.draw?.({ screen, sketch, state });
      } catch (error) {
        // The picture goes on without it.
        this.on.delete(aid.name);
        this.show();
        say(`${aid.words} is switched off: ${error.message}`);
      }
    }
  }
}
