// The view into the panorama: a shader asks for each pixel where its ray meets the panorama.

import { SURFACES } from '/geometry.js';

const VERTEX = `
  attribute vec2 corner;
  varying vec2 point;
  uniform vec2 reach, middle;
  void main() {
    point = corner * reach + middle;
    gl_Position = vec4(corner.x, -corner.y, 0.0, 1.0);
  }`;

const TURN = (2 * Math.PI).toFixed(9);

const CASES = Object.values(SURFACES).map(
  ({ shader }, kind) => `if (kind == ${kind}) return ${shader};`,
);

const RAYS = Object.values(SURFACES).map(
  ({ unfold }, kind) => `if (kind == ${kind}) return ${unfold};`,
);

const FRAGMENT = `
  precision highp float;
  varying vec2 point;
  uniform sampler2D panorama;
  uniform mat3 turn;
  uniform int kind;
  uniform bool wraps, isFlat, columnsAreBearings;
  uniform vec2 center, size, share;
  uniform float focal, near;
  vec2 place(vec3 ray) {
    ${CASES.join('\n    ')}
    return vec2(1e9);
  }
  vec3 unfold(vec2 point) {
    ${RAYS.join('\n    ')}
    return vec3(0.0, 0.0, -1.0);
  }
  void main() {
    vec3 ray = isFlat ? vec3(point, 1.0) : unfold(point);
    vec2 met = place(turn * ray);
    if (columnsAreBearings) met.x -= ${TURN} * floor((met.x - near) / ${TURN} + 0.5);
    vec2 where = (center + focal * met + 0.5) / size;
    if (wraps) where.x = fract(where.x);
    bool inside = all(greaterThanEqual(where, vec2(0.0))) && all(lessThanEqual(where, vec2(1.0)));
    gl_FragColor = inside ? texture2D(panorama, where * share) : vec4(0.063, 0.082, 0.106, 1.0);
    // Half a pixel from an edge the one beyond it has its part: as repeated textures have it,
    // which WebGL 1 has for powers of two only.
    float beside = min(where.x, 1.0 - where.x) * size.x;
    if (wraps && inside && beside < 0.5) {
      vec4 beyond = texture2D(panorama, vec2(1.0 - where.x, where.y) * share);
      gl_FragColor = mix(gl_FragColor, beyond, 0.5 - beside);
    }
  }`;

export class Look {
  /** Throws an Error where the browser has no WebGL. */
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext('webgl', { antialias: false, depth: false });
    if (!this.gl) throw new Error('this browser has no WebGL');
    this.prepare();
    canvas.addEventListener('webglcontextlost', (event) => event.preventDefault());
    canvas.addEventListener('webglcontextrestored', () => this.prepare());
  }

  prepare() {
    const { gl } = this;
    this.widest = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, 'corner');
    gl.linkProgram(program);
    gl.useProgram(program);
    this.at = (name) => gl.getUniformLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 0, 0);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) {
      gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    }
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    this.shown = null;
  }

  /** Draw what a view of a panorama shows. */
  draw(bitmap, projection, view) {
    const { gl, canvas } = this;
    const focal = view.focal(canvas.width, canvas.height);
    const [right, down, ahead] = [view.ray(1, 0), view.ray(0, 1), view.ray(0, 0)];
    const ray = [0, 1, 2];
    gl.uniform1i(this.at('isFlat'), true);
    gl.uniform2f(this.at('reach'), canvas.width / 2 / focal, canvas.height / 2 / focal);
    gl.uniform2f(this.at('middle'), 0, 0);
    gl.uniformMatrix3fv(this.at('turn'), false, [
      ...ray.map((i) => right[i] - ahead[i]), ...ray.map((i) => down[i] - ahead[i]), ...ahead,
    ]);
    this.fill(bitmap, projection, view.near(projection));
  }

  /** Draw a panorama on its own surface, by rows of a rotation of its rays to level ones. */
  turn(bitmap, projection, rows) {
    const { gl } = this;
    const { width, height, focal_px: focal, center_x_px: x, center_y_px: y } = projection;
    gl.uniform1i(this.at('isFlat'), false);
    gl.uniform2f(this.at('reach'), width / 2 / focal, height / 2 / focal);
    gl.uniform2f(this.at('middle'), ((width - 1) / 2 - x) / focal, ((height - 1) / 2 - y) / focal);
    gl.uniformMatrix3fv(this.at('turn'), false, rows); // as columns: the way back
    this.fill(bitmap, projection, projection.middle);
  }

  fill(bitmap, projection, near) {
    const { gl, canvas } = this;
    if (bitmap !== this.shown) {
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, gl.RGB, gl.UNSIGNED_BYTE, bitmap);
      this.shown = bitmap;
    }
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.uniform1i(this.at('kind'), Object.keys(SURFACES).indexOf(projection.surface));
    gl.uniform1i(this.at('wraps'), projection.wraps);
    gl.uniform1i(this.at('columnsAreBearings'), projection.kind.columnsAreBearings);
    gl.uniform1f(this.at('near'), near);
    gl.uniform2f(this.at('center'), projection.center_x_px, projection.center_y_px);
    gl.uniform2f(this.at('size'), projection.width, projection.height);
    gl.uniform2f(this.at('share'), ...projection.share(bitmap));
    gl.uniform1f(this.at('focal'), projection.focal_px);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }
}
