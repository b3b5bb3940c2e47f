// The viewer: pictures and state come in, and a person looks around.

import { Buttons } from '/buttons.js';
import * as controls from '/controls.js';
import { stickTo } from '/gamepad.js';
import { Live } from '/live.js';
import { Pictures, obstacle } from '/pictures.js';
import { Screen } from '/screen.js';
import { Status } from '/status.js';
import { Token } from '/token.js';

const $ = (id) => document.getElementById(id);
const LEAST_COSINE = 0.2; // of the pitch: nearer to the zenith a drag would turn ever faster

/** What pointer and keys can do. */
class Viewer {
  constructor(screen) {
    this.screen = screen;
    controls.dragTo($('look'), this);
    controls.wheelTo($('whole'), this);
    controls.pressTo($('map'), this);
    controls.keysTo(this, screen.aids.keys);
    stickTo(this);
    $('toggle').addEventListener('click', () => this.toggle());
    $('whole').addEventListener('click', (event) => {
      this.lookAt($('whole'), controls.inside($('whole'), event));
    });
    for (const canvas of [$('look'), $('whole'), $('map')]) {
      canvas.addEventListener('pointermove', (event) => {
        this.point([canvas, ...controls.inside(canvas, event)]);
      });
      canvas.addEventListener('pointerleave', () => this.point(null));
    }
  }

  point(pointer) {
    this.screen.pointer = pointer;
    this.screen.redraw();
  }

  drag(right, down) {
    const { view, focal } = this.screen;
    this.turn(-right / focal / Math.max(Math.cos(view.pitch), LEAST_COSINE), down / focal);
  }

  /** Turn by shares of the view. */
  step(right, up) {
    this.enter();
    this.turn(right * this.screen.view.fov, up * this.screen.view.fov);
  }

  turn(right, up) {
    const { view, projection } = this.screen;
    if (projection) view.turnTo(view.yaw + right, view.pitch + up, projection);
    this.screen.redraw();
  }

  zoom(factor) {
    this.enter();
    this.screen.view.zoom(factor);
    this.screen.redraw();
  }

  wheel(canvas, place, factor) {
    if (canvas === $('whole')) this.lookAt(canvas, place);
    this.zoom(factor);
  }

  lookAt(canvas, [x, y]) {
    const { view, projection, look } = this.screen;
    if (!projection || !look) return;
    view.turnTo(...this.screen.angles(canvas, x, y), projection);
    this.enter();
    this.screen.redraw();
  }

  enter() {
    if (this.screen.look && this.screen.mode !== 'look') this.toggle();
  }

  reset() {
    this.screen.view.reset(this.screen.projection);
    this.screen.redraw();
  }

  toggle() {
    if (this.screen.look) this.screen.mode = this.screen.mode === 'look' ? 'whole' : 'look';
  }
}

const screen = new Screen();
const status = new Status();
const token = new Token(() => live.open());
const buttons = new Buttons(token);
new Viewer(screen);
status.obstacle = await obstacle();
const pictures = new Pictures({
  restart: () => live.say('h264'),
  giveUp(reason) {
    status.obstacle = reason;
    live.say('jpeg');
  },
});
const UNPLACED = 'pictures come, but panorama/projection does not: nothing can be shown';
let hasPictures = false; // since the connection was opened
const live = new Live(token, () => !status.obstacle, {
  opened() {
    hasPictures = false;
    pictures.reset();
  },
  state(state) {
    const problems = state.problems ?? [];
    try {
      if (state.projection) screen.place(state.projection);
      else if (hasPictures) throw new Error(UNPLACED);
    } catch (error) {
      problems.push({ level: 'error', text: error.message });
    }
    buttons.needToken = state.needs_token;
    status.take({ ...state, problems });
    screen.aids.take(state);
  },
  async picture(data, orientation) {
    const image = await pictures.image(data, screen.projection, screen.widest);
    if (!image) return;
    hasPictures = true;
    await screen.show(image, orientation);
    if (screen.projection) status.picture();
  },
  lost: (reason) => status.lose(reason),
  refused() {
    token.forget();
    token.ask();
  },
});
