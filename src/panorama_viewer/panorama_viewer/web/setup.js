// For setting up: where one camera gives way to the next, and how far each of them sees.

const SEAM = '#ff4fd8';
const CAMERAS = ['#5ec8ff', '#9be15d', '#ffb347', '#c79bff'];
const POINTS = 90;
const ROOM = 22; // CSS px between the bars of neighbours, and above the first

export function setup({ screen, sketch, state }) {
  const { projection } = screen;
  // A ray would not tell which of two columns is meant.
  if (projection.repeats) return;
  const ray = (x, y) => screen.level.ray(projection.ray(x, y));
  const column = (x) => sampled(0, projection.height, (y) => ray(x - 0.5, y - 0.5));
  const overlaps = (state.overlaps ?? []).filter((overlap) => overlap.seam_begin_px != null);
  for (const { seam_begin_px: begin, seam_end_px: end } of overlaps) {
    sketch.line(column((begin + end) / 2), SEAM);
    for (const edge of end > begin ? [begin, end] : []) {
      sketch.line(column(edge), SEAM, { width: 1.5, dash: [6, 6] });
    }
  }
  const cameras = fields(overlaps, projection);
  for (const [i, { name, begin, end }] of cameras.entries()) {
    const color = CAMERAS[i % CAMERAS.length];
    // Of an odd ring the last one is beside the first: both have the same of two rows.
    const isThird = i === cameras.length - 1 && i % 2 === 0 && projection.wraps;
    const y = row(screen, ROOM * (isThird ? 3 : 1 + (i % 2)));
    // Of a levelled picture the column moves, but not the row: that may be the first one seen.
    const bar = (x) => {
      const [place] = projection.pixel(ray(x - 0.5, y)) ?? [x - 0.5];
      return projection.ray(place, y);
    };
    sketch.line(sampled(begin, end, bar), color, { width: 3 });
    for (const edge of [begin, end]) {
      sketch.line(column(edge), color, { width: 1.5, dash: [3, 6] });
    }
    sketch.words(bar(middle(screen, begin, end)), name, color);
  }
}

/** Columns [begin, end) in which each camera sees anything: the outer ones up to the edges. */
function fields(overlaps, { width }) {
  const cameras = new Map();
  const field = (name) => cameras.get(name)
    ?? cameras.set(name, { name, begin: 0, end: width }).get(name);
  for (const overlap of overlaps) {
    field(overlap.left).end = overlap.left_end_px;
    field(overlap.right).begin = overlap.right_begin_px;
  }
  return [...cameras.values()];
}

/** The column of a field at which its name is seen: where one looks, as far as that is in it. */
function middle({ projection, mode, view }, begin, end) {
  if (mode === 'whole') return (begin + end) / 2;
  const turn = projection.wraps ? projection.width : Infinity;
  const [x] = projection.pixel([Math.sin(view.yaw), 0, Math.cos(view.yaw)]) ?? [0];
  const beyond = [0, -turn, turn].find((aside) => begin <= x + aside && x + aside <= end) ?? 0;
  return Math.min(Math.max(x + beyond, begin), end);
}

/** Row of the panorama that is so far below the top of what is shown. */
function row(screen, y) {
  const { projection, shown } = screen;
  const [, up] = screen.angles(shown, shown.clientWidth / 2, y);
  const [, place] = projection.pixel([0, -Math.tan(up), 1]);
  return Math.min(Math.max(place, 0), projection.height - 1);
}

const sampled = (begin, end, at) => Array.from(
  { length: POINTS + 1 },
  (_, i) => at(begin + (i / POINTS) * (end - begin)),
);
