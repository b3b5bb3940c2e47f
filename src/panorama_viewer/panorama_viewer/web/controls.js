// Pointer, wheel and keyboard, turned into what the viewer can do.

const WHEEL = 0.0015; // zoom of one px of wheel, as a logarithm
const STEP = 0.1; // of the view's width that an arrow key turns
const KEY_ZOOM = 1.2;

const press = (button) => document.getElementById(button).click();

/** Position of an event in an element, CSS px. */
export const inside = (element, event) => {
  const box = element.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
};

/** Drag to turn, two fingers or the wheel to zoom. */
export function dragTo(canvas, viewer) {
  const fingers = new Map();
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
  };
  canvas.addEventListener('pointerdown', (event) => {
    if (event.button) return;
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, event);
  });
  canvas.addEventListener('pointermove', (event) => {
    // A menu may have kept its end from us.
    if (!event.buttons) fingers.delete(event.pointerId);
    const last = fingers.get(event.pointerId);
    if (!last) return;
    const before = fingers.size > 1 ? spread() : 0;
    fingers.set(event.pointerId, event);
    if (before) viewer.zoom(spread() / before);
    else viewer.drag(event.clientX - last.clientX, event.clientY - last.clientY);
  });
  for (const end of ['pointerup', 'pointercancel']) {
    canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
  }
  wheelTo(canvas, viewer);
}

/** The wheel zooms, towards where it is turned if that is not the view yet. */
export function wheelTo(canvas, viewer) {
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 : 1;
    viewer.wheel(canvas, inside(canvas, event), Math.exp(-event.deltaY * lines * WHEEL));
  }, { passive: false });
}

/** Press or drag to look there. */
export function pressTo(canvas, viewer) {
  const look = (event) => viewer.lookAt(canvas, inside(canvas, event));
  canvas.addEventListener('pointerdown', (event) => {
    if (event.button) return;
    canvas.setPointerCapture(event.pointerId);
    look(event);
  });
  canvas.addEventListener('pointermove', (event) => {
    if (event.buttons && canvas.hasPointerCapture(event.pointerId)) look(event);
  });
}

/** Keys, and `more` of them: what they do is written in the buttons' titles too. */
export function keysTo(viewer, more) {
  const keys = {
    ...more,
    ArrowLeft: () => viewer.step(-STEP, 0),
    ArrowRight: () => viewer.step(STEP, 0),
    ArrowUp: () => viewer.step(0, STEP),
    ArrowDown: () => viewer.step(0, -STEP),
    '+': () => viewer.zoom(KEY_ZOOM),
    '=': () => viewer.zoom(KEY_ZOOM),
    '-': () => viewer.zoom(1 / KEY_ZOOM),
    0: () => viewer.reset(),
    v: () => viewer.toggle(),
    c: () => press('calibrate'),
    s: () => press('snapshot'),
    f: () => press('fullscreen'),
  };
  document.addEventListener('keydown', (event) => {
    const isTyping = event.target.closest('input, dialog');
    const action = keys[event.key.length > 1 ? event.key : event.key.toLowerCase()];
    if (!action || isTyping || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action();
  });
}
