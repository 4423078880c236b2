// Points and lines in three dimensions with WebGL 2. In: typed arrays. Out: a picture on a canvas that pointer and keys turn.
// The world has x to the right, y down and z forward, as the first camera. Returns null without WebGL 2.
function yfScene(canvas, changed) {
  'use strict';
  const gl = canvas.getContext('webgl2', { antialias: true, alpha: true, premultipliedAlpha: false });
  if (!gl) return null;
  const compile = (type, text) => {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    return shader;
  };
  let program, at;
  const items = new Map();
  const begin = () => {
    program = gl.createProgram();
    gl.attachShader(program, compile(gl.VERTEX_SHADER, `#version 300 es
      layout(location=0) in vec3 p; layout(location=1) in vec3 c; uniform mat4 m; uniform float s, k; out vec3 v;
      void main(){ gl_Position = m * vec4(p, 1.); gl_PointSize = max(k, s / max(gl_Position.w, .05)); v = c; }`));
    gl.attachShader(program, compile(gl.FRAGMENT_SHADER, `#version 300 es
      precision mediump float; in vec3 v; uniform float a; uniform bool r; out vec4 o;
      void main(){ if (r && length(gl_PointCoord - .5) > .5) discard; o = vec4(v, a); }`));
    gl.linkProgram(program);
    at = {};
    for (const name of ['m', 's', 'k', 'a', 'r']) at[name] = gl.getUniformLocation(program, name);
  };
  begin();
  const scene = { mode: 'orbit', grid: 1, draws: 0, items, target: [0, 0, 2], yaw: -0.6, pitch: 0.55, heading: 0, distance: 5, pose: null, touched: false };

  // Column by column, as WebGL.
  const multiply = (a, b) => {
    const out = new Float32Array(16);
    for (let i = 0; i < 4; i++)
      for (let j = 0; j < 4; j++) for (let k = 0; k < 4; k++) out[4 * i + j] += a[4 * k + j] * b[4 * i + k];
    return out;
  };
  const sub = (a, b) => a.map((v, i) => v - b[i]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((v) => v / n); };

  function eyeAndAxes() {
    let { yaw, pitch, target } = scene;
    if (scene.mode === 'top') pitch = Math.PI / 2 - 1e-4;
    if (scene.mode === 'follow' && scene.pose) {
      const p = scene.pose;
      yaw += Math.atan2(p[8], p[10]) + 0.6;
      target = [p[12] + p[8], p[13] + p[9], p[14] + p[10]];
    } else if (scene.mode === 'top') yaw = scene.heading;
    const forward = [Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch), Math.cos(pitch) * Math.cos(yaw)];
    const right = [Math.cos(yaw), 0, -Math.sin(yaw)];
    const down = cross(forward, right);
    const eye = target.map((v, i) => v - scene.distance * forward[i]);
    return { eye, right, down, forward };
  }

  function matrix(width, height) {
    const { eye, right, down, forward } = eyeAndAxes();
    const view = new Float32Array(16);
    [right, down.map((v) => -v), forward.map((v) => -v)].forEach((axis, row) => {
      for (let i = 0; i < 3; i++) view[4 * i + row] = axis[i];
      view[12 + row] = -dot(axis, eye);
    });
    view[15] = 1;
    const far = Math.max(60, scene.distance * 20), near = Math.min(0.05, far / 1e3) + scene.distance * 0.01;
    const f = 1.5, aspect = width / Math.max(height, 1);
    const lens = new Float32Array([f / Math.max(aspect, 1), 0, 0, 0, 0, (f / Math.max(aspect, 1)) * aspect, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0]);
    if (aspect > 1) { lens[0] = f / aspect; lens[5] = f; }
    return multiply(lens, view);
  }

  // Puts an item into the scene. options: color [r, g, b] for all, matrix, size m, least px, alpha, strip, unit m of whole numbers.
  function put(kind, id, positions, colors, options) {
    const old = items.get(id);
    const item = { kind, positions, colors, visible: old ? old.visible : true, ...options };
    if (old) for (const name of ['p', 'c']) if (old[name]) gl.deleteBuffer(old[name]);
    upload(item);
    items.set(id, item);
    redraw();
    return item;
  }
  function upload(item) {
    const buffer = (data) => {
      const made = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, made);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      return made;
    };
    item.count = item.positions.length / 3;
    item.p = buffer(item.positions);
    item.c = item.colors ? buffer(item.colors) : null;
  }
  function remove(id) {
    const item = items.get(id);
    if (!item) return;
    for (const name of ['p', 'c']) if (item[name]) gl.deleteBuffer(item[name]);
    items.delete(id);
    redraw();
  }

  let waiting = false;
  function redraw() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; draw(); });
  }
  function draw() {
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth * ratio | 0, canvas.clientHeight * ratio | 0];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    if (!width || !height || gl.isContextLost()) return;
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(program);
    const eye = matrix(width, height);
    // What is see-through comes last.
    for (const item of [...items.values()].sort((a, b) => (b.alpha || 1) - (a.alpha || 1))) {
      if (!item.visible || !item.count) continue;
      let m = item.matrix ? multiply(eye, item.matrix) : eye;
      if (item.unit) m = multiply(m, new Float32Array([item.unit, 0, 0, 0, 0, item.unit, 0, 0, 0, 0, item.unit, 0, 0, 0, 0, 1]));
      gl.uniformMatrix4fv(at.m, false, m);
      gl.uniform1f(at.s, (item.size || 0) * 0.75 * Math.min(width, height) * 1.5);
      gl.uniform1f(at.k, (item.least || 1.5) * ratio);
      gl.uniform1f(at.a, item.alpha || 1);
      gl.uniform1i(at.r, item.kind === 'points' && item.round ? 1 : 0);
      gl.bindBuffer(gl.ARRAY_BUFFER, item.p);
      gl.enableVertexAttribArray(0);
      gl.vertexAttribPointer(0, 3, item.positions instanceof Int16Array ? gl.SHORT : gl.FLOAT, false, 0, 0);
      if (item.c) {
        gl.bindBuffer(gl.ARRAY_BUFFER, item.c);
        gl.enableVertexAttribArray(1);
        gl.vertexAttribPointer(1, 3, gl.UNSIGNED_BYTE, true, 0, 0);
      } else {
        gl.disableVertexAttribArray(1);
        gl.vertexAttrib3f(1, ...item.color);
      }
      gl.drawArrays(item.kind === 'points' ? gl.POINTS : item.strip ? gl.LINE_STRIP : gl.LINES, 0, item.count);
    }
    scene.draws++;
  }

  // Places the view so that most of these points are in it, and all of `needed`.
  function fit(positions, needed) {
    const count = positions.length / 3 | 0;
    if (count < 2) return;
    const every = Math.max(1, count / 3000 | 0);
    const range = [0, 1, 2].map((axis) => {
      const values = [];
      for (let i = 0; i < count; i += every) if (isFinite(positions[3 * i + axis])) values.push(positions[3 * i + axis]);
      values.sort((a, b) => a - b);
      const ends = [values[values.length * 0.03 | 0], values[(values.length - 1) * 0.97 | 0]];
      for (let i = axis; i < needed.length; i += 3) { ends[0] = Math.min(ends[0], needed[i]); ends[1] = Math.max(ends[1], needed[i]); }
      return ends;
    });
    scene.target = range.map(([a, b]) => (a + b) / 2);
    scene.distance = Math.max(1.5, 1.15 * Math.hypot(...range.map(([a, b]) => b - a)));
    ground(range);
    redraw();
  }
  // A grid below the points; its squares are the scale.
  function ground(range, color) {
    const span = Math.max(range[0][1] - range[0][0], range[2][1] - range[2][0], 1);
    const step = [0.5, 1, 2, 5, 10, 20, 50, 100, 500].find((s) => span / s <= 12) || 1000;
    const low = [0, 2].map((axis) => Math.floor(range[axis][0] / step - 1) * step);
    const high = [0, 2].map((axis) => Math.ceil(range[axis][1] / step + 1) * step);
    const y = range[1][1], lines = [];
    for (let x = low[0]; x <= high[0] + 1e-6; x += step) lines.push(x, y, low[1], x, y, high[1]);
    for (let z = low[1]; z <= high[1] + 1e-6; z += step) lines.push(low[0], y, z, high[0], y, z);
    scene.grid = step;
    put('lines', 'grid', new Float32Array(lines), null, { color: color || scene.gridColor || [0.5, 0.5, 0.5], alpha: 0.6 });
    if (changed) changed();
  }

  function setMode(mode) {
    scene.mode = mode;
    if (changed) changed();
    redraw();
  }
  function turn(dx, dy) {
    scene.touched = true;
    if (scene.mode === 'top') scene.heading -= dx;
    else { scene.yaw += dx; scene.pitch = Math.max(-1.5, Math.min(1.55, scene.pitch + dy)); }
    redraw();
  }
  function shift(dx, dy) {
    scene.touched = true;
    const { right, down } = eyeAndAxes();
    const by = scene.distance / Math.max(200, canvas.clientHeight);
    scene.target = scene.target.map((v, i) => v - by * (dx * right[i] + dy * down[i]));
    redraw();
  }
  function zoom(by) {
    scene.touched = true;
    scene.distance = Math.max(0.2, Math.min(5000, scene.distance * by));
    redraw();
  }
  const pointers = new Map();
  canvas.addEventListener('pointerdown', (e) => { canvas.setPointerCapture(e.pointerId); pointers.set(e.pointerId, [e.clientX, e.clientY]); });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (e) => pointers.delete(e.pointerId));
  canvas.addEventListener('pointermove', (e) => {
    const last = pointers.get(e.pointerId);
    if (!last) return;
    const [dx, dy] = [e.clientX - last[0], e.clientY - last[1]];
    const spread = () => { const [a, b] = [...pointers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]) || 1; };
    const before = pointers.size === 2 ? spread() : 0;
    pointers.set(e.pointerId, [e.clientX, e.clientY]);
    if (pointers.size === 2) { zoom(before / spread()); shift(dx / 2, dy / 2); }
    else if (e.shiftKey || e.buttons === 2 || e.buttons === 4) shift(dx, dy);
    else turn(dx * 0.007, dy * 0.007);
  });
  canvas.addEventListener('contextmenu', (e) => e.preventDefault());
  canvas.addEventListener('wheel', (e) => { e.preventDefault(); zoom(Math.exp(Math.max(-100, Math.min(100, e.deltaY)) * 0.002)); }, { passive: false });
  canvas.addEventListener('keydown', (e) => {
    const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key];
    if (step) { e.shiftKey ? shift(300 * step[0], -300 * step[1]) : turn(...step); e.preventDefault(); }
    if (e.key === '+' || e.key === '=') zoom(0.9);
    if (e.key === '-') zoom(1.1);
  });
  canvas.addEventListener('webglcontextlost', (e) => e.preventDefault());
  canvas.addEventListener('webglcontextrestored', () => { begin(); items.forEach(upload); redraw(); });
  new ResizeObserver(redraw).observe(canvas);

  // The outline of a camera in its own frame, for put('lines', …).
  const frustum = (w, h, fx, fy, depth) => {
    const [x, y] = [(w / fx / 2) * depth, (h / fy / 2) * depth], c = [[-x, -y], [x, -y], [x, y], [-x, y]], out = [];
    c.forEach((a, i) => { const b = c[(i + 1) % 4]; out.push(0, 0, 0, ...a, depth, ...a, depth, ...b, depth); });
    out.push(-x * 0.4, -y, depth, 0, -y * 1.5, depth, 0, -y * 1.5, depth, x * 0.4, -y, depth);
    return new Float32Array(out);
  };
  const points = (id, positions, colors, options) => put('points', id, positions, colors, options);
  const lines = (id, positions, colors, options) => put('lines', id, positions, colors, options);
  return Object.assign(scene, { points, lines, remove, redraw, draw, fit, setMode, frustum, turn, zoom });
}
// Returns a colour of the style sheet as three numbers between 0 and 1.
function yfColor(name) {
  const text = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const hex = text.length === 4 ? text.replace(/[0-9a-f]/gi, '$&$&') : text;
  return [1, 3, 5].map((i) => (parseInt(hex.slice(i, i + 2), 16) || 0) / 255);
}
