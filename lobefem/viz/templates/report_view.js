// The 3D view: film, plates, hoops, tendons and bar by WebGL; a mode swings in the vertex shader.

const FILM = `#version 300 es
in vec3 p; in vec3 re; in vec3 im; in vec3 n; in vec3 nre; in vec3 nim; in vec3 v;
uniform mat4 camera; uniform mat3 turn; uniform float c; uniform float s;
out vec3 normal; out vec3 place; out float value;
void main() {
  vec3 at = turn * (p + c * re - s * im);
  normal = turn * (n + c * nre - s * nim);
  place = at;
  value = v.x + c * v.y - s * v.z;
  gl_Position = camera * vec4(at, 1.0);
}`;
const LIGHT = `#version 300 es
precision highp float;
in vec3 normal; in vec3 place; in float value;
uniform sampler2D palette; uniform vec3 eye; uniform vec3 right; uniform vec3 up; uniform vec4 plain;
out vec4 colour;
void main() {
  vec3 to = normalize(eye - place), n = normalize(normal);
  bool inner = dot(n, to) < 0.0;
  if (inner) n = -n;
  vec3 lamp = normalize(to + 0.9 * up - 0.7 * right);
  float lit = 0.40 + 0.52 * max(dot(n, lamp), 0.0) + 0.16 * max(dot(n, to), 0.0);
  float shine = 0.18 * pow(max(dot(n, normalize(lamp + to)), 0.0), 40.0);
  float rim = 0.10 * pow(1.0 - max(dot(n, to), 0.0), 3.0);
  vec3 base = plain.a > 0.5 ? plain.rgb : texture(palette, vec2(clamp(value, 0.002, 0.998), 0.5)).rgb;
  colour = vec4(base * lit * (inner ? 0.72 : 1.0) + shine - rim, 1.0);
}`;
const STROKE = `#version 300 es
in vec3 p; in vec3 re; in vec3 im; in vec3 q; in vec3 qre; in vec3 qim; in float side;
uniform mat4 camera; uniform mat3 turn; uniform float c; uniform float s; uniform vec2 size; uniform float width;
void main() {
  vec4 a = camera * vec4(turn * (p + c * re - s * im), 1.0), b = camera * vec4(turn * (q + c * qre - s * qim), 1.0);
  vec2 along = (b.xy / b.w - a.xy / a.w) * size * (side > 1.5 || side < -1.5 ? -1.0 : 1.0);
  along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  vec2 across = vec2(-along.y, along.x) * sign(side) * width / size;
  gl_Position = a + vec4(across * a.w, -0.0015 * a.w, 0.0);
}`;
const INK = `#version 300 es
precision mediump float;
uniform vec4 ink; out vec4 colour;
void main() { colour = ink; }`;

function unpack(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Kind(bytes.buffer);
}
function normalsOf(x, cells) {
  const n = new Float32Array(x.length);
  for (let t = 0; t < cells.length; t += 3) {
    const [i, j, k] = [3 * cells[t], 3 * cells[t + 1], 3 * cells[t + 2]];
    const ax = x[j] - x[i], ay = x[j + 1] - x[i + 1], az = x[j + 2] - x[i + 2];
    const bx = x[k] - x[i], by = x[k + 1] - x[i + 1], bz = x[k + 2] - x[i + 2];
    const cx = ay * bz - az * by, cy = az * bx - ax * bz, cz = ax * by - ay * bx;
    for (const m of [i, j, k]) {
      n[m] += cx;
      n[m + 1] += cy;
      n[m + 2] += cz;
    }
  }
  for (let m = 0; m < n.length; m += 3) {
    const size = Math.hypot(n[m], n[m + 1], n[m + 2]) || 1;
    n[m] /= size;
    n[m + 1] /= size;
    n[m + 2] /= size;
  }
  return n;
}
function times(a, b) { // 4 x 4, by columns
  const out = new Float32Array(16);
  for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++) for (let k = 0; k < 4; k++) out[4 * i + j] += b[4 * i + k] * a[4 * k + j];
  return out;
}

class View {
  constructor(canvas, palettes) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.gl = gl;
    this.film = this.program(FILM, LIGHT);
    this.stroke = this.program(STROKE, INK);
    this.palettes = Object.fromEntries(Object.entries(palettes).map(([name, text]) => [name, this.texture(unpack(text, Uint8Array))]));
    this.home();
    this.parts = [];
    this.amplitude = 1;
    this.phase = 0;
  }
  program(vertex, fragment) {
    const { gl } = this, made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error("the 3D view cannot be drawn: " + gl.getProgramInfoLog(made));
    const names = ["camera", "turn", "c", "s", "eye", "right", "up", "plain", "palette", "ink", "size", "width"];
    made.places = Object.fromEntries(names.map((name) => [name, gl.getUniformLocation(made, name)]));
    return made;
  }
  texture(rgb) {
    const { gl } = this, made = gl.createTexture(), count = rgb.length / 3;
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB8, count, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, rgb);
    const how = count < 16 ? gl.NEAREST : gl.LINEAR;
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, how);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, how);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    return made;
  }
  home() {
    this.around = -1.1;
    this.above = 0.26;
    this.zoom = 1;
  }
  buffers(program, arrays, count) {
    const { gl } = this, object = gl.createVertexArray(), made = [];
    gl.bindVertexArray(object);
    for (const [name, [values, size]] of Object.entries(arrays)) {
      const at = gl.getAttribLocation(program, name);
      if (at < 0) continue;
      const buffer = gl.createBuffer();
      made.push(buffer);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
    }
    gl.bindVertexArray(null);
    return { object, made, count };
  }
  // A scene with its arrays unpacked once.
  prepare(scene) {
    if (scene.nodes) return;
    scene.nodes = unpack(scene.x, Float32Array);
    scene.cells = unpack(scene.triangles, Uint32Array);
    scene.of = unpack(scene.owners, Uint32Array);
    scene.loops = scene.plates.map((loop) => unpack(loop, Uint32Array));
    scene.strokes = scene.lines.map((line) => ({ kind: line.kind, nodes: unpack(line.nodes, Uint32Array) }));
    scene.drawn = scene.outline.map((line) => unpack(line, Uint32Array));
  }
  // Put a state of a scene into the view: with a mode, or coloured by a field, or plain.
  set(scene, state, mode, field, factor) {
    this.prepare(scene);
    const { gl } = this, { nodes, cells } = scene, count = nodes.length;
    const grown = (one, by) => {
      const out = new Float32Array(count);
      if (one && one.moved) unpack(one.moved, Int16Array).forEach((v, k) => { out[k] = v * one.scale * by; });
      return out;
    };
    const p = grown(state, factor), re = grown(mode, 1), im = grown(mode && mode.imaginary, 1);
    for (let k = 0; k < count; k++) p[k] += nodes[k];
    const n = normalsOf(p, cells), add = (a, b) => a.map((v, k) => v + b[k]);
    const less = (a, b) => a.map((v, k) => v - b[k]);
    const none = new Float32Array(count);
    const nre = mode ? less(normalsOf(add(p, re), cells), n) : none;
    const nim = mode && mode.imaginary ? less(normalsOf(add(p, im), cells), n) : none;
    const values = new Float32Array(count); // triples: constant, with the real part, with the imaginary one
    let perCell = null, palette = this.palettes.size, plain = null;
    if (mode) {
      let largest = 1e-30, most = 1e-30;
      for (let k = 0; k < count; k += 3) {
        let a = 0, b = 0;
        for (let m = k; m < k + 3; m++) {
          a += n[m] * re[m];
          b += n[m] * im[m];
        }
        values[k] = 0.5;
        values[k + 1] = a;
        values[k + 2] = b;
        largest = Math.max(largest, Math.hypot(a, b));
        most = Math.max(most, Math.hypot(re[k], re[k + 1], re[k + 2]));
      }
      this.sideways = largest < 0.3 * most; // a twist: the film moves within itself
      for (let k = 0; k < count; k += 3) {
        values[k + 1] *= 0.5 / largest;
        values[k + 2] *= 0.5 / largest;
        if (this.sideways) values.set([Math.hypot(re[k], re[k + 1], re[k + 2]) / most, 0, 0], k);
      }
      palette = this.sideways ? this.palettes.size : this.palettes.motion;
    } else if (field) {
      const shares = unpack(field.values, Uint16Array);
      palette = this.palettes[field.kind];
      if (field.cells) perCell = shares;
      else for (let k = 0; k < count / 3; k++) values[3 * k] = shares[k] / 65535;
    } else plain = [0.82, 0.84, 0.87, 1];
    const vertices = cells.length, out = {};
    for (const [name, from] of Object.entries({ p, re, im, n, nre, nim, v: values })) {
      const flat = new Float32Array(3 * vertices);
      for (let k = 0; k < vertices; k++) for (let m = 0; m < 3; m++) flat[3 * k + m] = from[3 * cells[k] + m];
      out[name] = [flat, 3];
    }
    if (perCell) for (let k = 0; k < vertices; k++) out.v[0][3 * k] = perCell[scene.of[Math.floor(k / 3)]] / 65535;

    this.parts.forEach((part) => {
      part.made.forEach((buffer) => gl.deleteBuffer(buffer));
      gl.deleteVertexArray(part.object);
    });
    this.parts = [{ kind: "film", palette, plain, ...this.buffers(this.film, out, vertices) }];
    const open = scene.copies > 1 ? 1 : 0; // a gore's end is a part of the fitting's edge, its middle on the axis
    const middles = scene.loops.map((loop) => [p, re, im].map((a) => [0, 1, 2].map((m) => (open && m < 2 ? 0 : loop.reduce((sum, k) => sum + a[3 * k + m], 0) / loop.length))));
    scene.loops.forEach((loop, l) => {
      const corner = loop.length - open, plate = Object.fromEntries(["p", "re", "im", "n", "nre", "nim", "v"].map((name) => [name, [new Float32Array(9 * corner), 3]]));
      const put = (at, which) => ["p", "re", "im"].forEach((name, a) => [0, 1, 2].forEach((m) => {
        plate[name][0][3 * at + m] = which < 0 ? middles[l][a][m] : [p, re, im][a][3 * which + m];
      }));
      for (let k = 0; k < corner; k++) {
        put(3 * k, loop[k]);
        put(3 * k + 1, loop[(k + 1) % loop.length]);
        put(3 * k + 2, -1);
        for (let m = 2; m < 9; m += 3) plate.n[0][9 * k + m] = 1;
      }
      this.parts.push({ kind: "plate", palette, plain: [0.62, 0.64, 0.67, 1], ...this.buffers(this.film, plate, 3 * corner) });
    });
    const line = (kind, pairs) => { // pairs of ends, each a triple of arrays p, re, im
      const strokes = Object.fromEntries(["p", "re", "im", "q", "qre", "qim"].map((name) => [name, [new Float32Array(18 * pairs.length), 3]]));
      const side = new Float32Array(6 * pairs.length);
      pairs.forEach(([a, b], k) => [[a, b, 1], [a, b, -1], [b, a, 2], [b, a, 2], [a, b, -1], [b, a, -2]].forEach(([one, other, sign], v) => {
        const at = 6 * k + v;
        side[at] = sign;
        [["p", one, 0], ["re", one, 1], ["im", one, 2], ["q", other, 0], ["qre", other, 1], ["qim", other, 2]].forEach(([name, end, part]) => strokes[name][0].set(end[part], 3 * at));
      }));
      this.parts.push({ kind, ...this.buffers(this.stroke, { ...strokes, side: [side, 1] }, 6 * pairs.length) });
    };
    const end = (k) => [p, re, im].map((a) => a.subarray(3 * k, 3 * k + 3));
    const still = (k) => [nodes.subarray(3 * k, 3 * k + 3), [0, 0, 0], [0, 0, 0]];
    const chain = (list, of) => Array.from(list).slice(1).map((k, i) => [of(list[i]), of(k)]);
    for (const one of scene.strokes) {
      if (one.kind === "bar") {
        if (middles.length === 2) line("bar", [[middles[0], middles[1]]]);
      } else line(one.kind, chain(one.nodes, end));
    }
    const outline = scene.drawn.flatMap((list) => chain(list, still));
    if (outline.length) line("outline", outline.filter((_, k) => k % 2 === 0)); // dashed

    this.scene = scene;
    this.mode = mode;
    let low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let k = 0; k < count; k += 3) for (let m = 0; m < 3; m++) {
      low[m] = Math.min(low[m], nodes[k + m], p[k + m]);
      high[m] = Math.max(high[m], nodes[k + m], p[k + m]);
    }
    if (scene.copies > 1) {
      const reach = Math.max(...[0, 1].flatMap((m) => [Math.abs(low[m]), Math.abs(high[m])]));
      low = [-reach, -reach, low[2]];
      high = [reach, reach, high[2]];
    }
    this.centre = low.map((v, m) => (v + high[m]) / 2);
    this.half = [Math.hypot(high[0] - low[0], high[1] - low[1]) / 2 / Math.SQRT2, (high[2] - low[2]) / 2];
    this.draw();
  }
  draw() {
    const { gl, canvas } = this;
    if (!this.centre) return;
    const ratio = Math.min(window.devicePixelRatio || 1, 2), width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (!width || !height) return;
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const aspect = width / height, open = Math.tan(0.26);
    const [round, tall] = this.half, lean = Math.abs(Math.sin(this.above));
    const need = Math.max((1.12 * round) / aspect, tall * Math.cos(this.above) + round * lean, 1e-9);
    const far = ((1.12 * need) / open + round) / this.zoom;
    const flat = Math.cos(this.above), to = [flat * Math.cos(this.around), flat * Math.sin(this.around), Math.sin(this.above)];
    const right = [-Math.sin(this.around), Math.cos(this.around), 0];
    const up = [to[1] * right[2] - to[2] * right[1], to[2] * right[0] - to[0] * right[2], to[0] * right[1] - to[1] * right[0]];
    const eye = this.centre.map((v, m) => v + far * to[m]), dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const near = Math.max(far - 4 * Math.max(round, tall), 0.02 * far), back = far + 4 * Math.max(round, tall);
    const look = new Float32Array([right[0], up[0], to[0], 0, right[1], up[1], to[1], 0, right[2], up[2], to[2], 0, -dot(right, eye), -dot(up, eye), -dot(to, eye), 1]);
    const lens = new Float32Array([1 / (open * aspect), 0, 0, 0, 0, 1 / open, 0, 0, 0, 0, -(back + near) / (back - near), -1, 0, 0, (-2 * back * near) / (back - near), 0]);
    const camera = times(lens, look);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    const inks = { hoop: [[0.12, 0.14, 0.17, 1], 2.2], seam: [[0.35, 0.38, 0.42, 1], 0.8], tendon: [[0.12, 0.14, 0.17, 1], this.scene.copies > 120 || this.scene.strokes.length > 120 ? 0.7 : 1.1], bar: [[0.12, 0.14, 0.17, 1], 2.2], outline: [[0.5, 0.53, 0.57, 0.85], 0.6], meridian: [[0.1, 0.12, 0.15, 0.3], 0.45] };
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    const flutter = this.mode && this.mode.imaginary && this.scene.copies === 1;
    const pass = (part, hidden) => {
      const film = part.kind === "film" || part.kind === "plate", program = film ? this.film : this.stroke;
      gl.useProgram(program);
      const place = (name) => program.places[name];
      gl.uniformMatrix4fv(place("camera"), false, camera);
      if (film) {
        gl.uniform3fv(place("eye"), eye);
        gl.uniform3fv(place("right"), right);
        gl.uniform3fv(place("up"), up);
        gl.uniform4fv(place("plain"), part.plain || [0, 0, 0, 0]);
        gl.activeTexture(gl.TEXTURE0);
        gl.bindTexture(gl.TEXTURE_2D, part.palette);
        gl.uniform1i(place("palette"), 0);
      } else {
        let [ink, wide] = inks[part.kind];
        if (dark && part.kind !== "outline" && part.kind !== "seam") ink = part.kind === "bar" ? [0.9, 0.92, 0.95, 1] : ink;
        gl.uniform4fv(place("ink"), hidden ? [ink[0], ink[1], ink[2], 0.25] : ink);
        gl.uniform2f(place("size"), width, height);
        gl.uniform1f(place("width"), 2 * wide * ratio);
      }
      gl.bindVertexArray(part.object);
      const copies = part.kind === "outline" ? 1 : this.scene.copies, n = this.mode ? this.mode.harmonic : 0;
      for (let k = 0; k < copies; k++) {
        const angle = (2 * Math.PI * k) / copies, a = Math.cos(angle), b = Math.sin(angle);
        gl.uniformMatrix3fv(place("turn"), false, [a, b, 0, -b, a, 0, 0, 0, 1]);
        const swing = this.amplitude * Math.cos(this.phase);
        const c = flutter ? swing : swing * Math.cos(n * angle * (copies > 1)), s = flutter ? -this.amplitude * Math.sin(this.phase) : swing * Math.sin(n * angle * (copies > 1));
        gl.uniform1f(place("c"), c);
        gl.uniform1f(place("s"), s);
        gl.drawArrays(gl.TRIANGLES, 0, part.count);
      }
    };
    for (const part of this.parts) {
      if (part.kind === "bar") { // seen through the film
        gl.depthFunc(gl.GREATER);
        gl.depthMask(false);
        pass(part, true);
        gl.depthFunc(gl.LESS);
        gl.depthMask(true);
      }
      if (part.kind === "outline" && this.amplitude === 0 && this.mode) continue;
      pass(part, false);
    }
    gl.bindVertexArray(null);
  }
  turn(how) {
    const step = Math.PI / 12, moves = { left: [-step, 0], right: [step, 0], up: [0, step], down: [0, -step] };
    if (how === "reset") this.home();
    else if (how in moves) {
      this.around += moves[how][0];
      this.above = Math.max(-1.5, Math.min(1.5, this.above + moves[how][1]));
    } else this.zoom = Math.max(0.3, Math.min(12, this.zoom * (how === "nearer" ? 1.18 : 1 / 1.18)));
    this.draw();
  }
}
