// The page: asks for what is newer than what it has, keeps the last frames, and shows one of them.
(() => {
  'use strict';
  const $ = (id) => document.getElementById(id);
  // Frames that are kept for looking back, and their images, bytes.
  const KEPT = 3000, KEPT_BYTES = 96e6, MAX_PLOT = 20000;
  const app = (window.yfslam = {
    frames: 0, ticks: 0, points: 0, keyframes: 0, patches: 0, edges: 0, movers: 0, features: 0, state: 'connecting', reason: null, error: null, run: 0, paused: false, ended: false,
    gl: false, connected: false, past: false, shown: 0, loops: 0, bytes: 0,
  });
  const scene = yfScene($('scene'), note);
  app.gl = !!scene;
  app.scene = scene;
  $('nogl').hidden = !!scene;
  $('scene').hidden = !scene;
  let hello, seen, history, kept, plots, keyframes, patches, paths, shown = null, past = null, busy = false;

  function reset() {
    seen = { frame: 0, map: 0, patch: 0, control: 0 };
    [history, kept, plots, keyframes, patches] = [[], 0, { t: [], inliers: [], ms: [] }, new Map(), new Map()];
    [shown, past] = [null, null];
    if (scene) for (const id of [...scene.items.keys()]) if (id !== 'grid' && !String(id).startsWith('path')) scene.remove(id);
    Object.assign(app, { frames: 0, ticks: 0, points: 0, keyframes: 0, patches: 0, edges: 0, movers: 0, loops: 0 });
  }

  function* packets(buffer) {
    const view = new DataView(buffer), text = new TextDecoder();
    for (let at = 0; at + 8 <= buffer.byteLength; ) {
      const end = at + 4 + view.getUint32(at, true), length = view.getUint32(at + 4, true);
      const head = JSON.parse(text.decode(new Uint8Array(buffer, at + 8, length)));
      let from = at + 8 + length;
      for (const [name, bytes] of head.parts) { head[name] = buffer.slice(from, from + bytes); from += bytes; }
      yield head;
      at = end;
    }
  }

  const pause = (ms) => new Promise((done) => setTimeout(done, ms));
  async function listen() {
    for (;;) {
      try {
        if (!hello) begin([...packets(await (await fetch('hello')).arrayBuffer())][0]);
        const run = document.hidden ? '' : 'run=' + app.run + '&';
        const asked = app.run;
        const url = `next?${run}frame=${seen.frame}&map=${seen.map}&patch=${seen.patch}&control=${seen.control}&paths=${paths.map((p) => p.number)}`;
        const answer = await fetch(url);
        if (!answer.ok) throw new Error(await answer.text());
        const buffer = await answer.arrayBuffer();
        app.connected = true;
        app.bytes += buffer.byteLength;
        for (const packet of packets(buffer)) if (asked === app.run || packet.kind === 'control') take[packet.kind](packet);
        if (app.ended) return;
      } catch (error) {
        app.connected = false;
        badge();
        await pause(1000);
      }
    }
  }

  function begin(packet) {
    hello = packet;
    $('title').textContent = hello.title;
    document.title = hello.title + ' – yfslam';
    paths = hello.runs.map(() => ({ number: 0 }));
    $('runs').hidden = hello.runs.length < 2;
    $('run').replaceChildren(...hello.runs.map((name, i) => new Option(name, i)));
    app.run = hello.runs.length - 1;
    $('run').value = app.run;
    $('control').hidden = !hello.can_pause;
    app.truth = hello.truth.byteLength / 12;
    $('f2').hidden = !app.truth;
    const key = (color, name, kind) => `<i class="${kind || ''}" style="background:${color};border-color:${color}"></i>${name}`;
    $('trustkey').innerHTML = key('#3cff3c', 'static, matched') + key('#008200', 'static') + key('#ff1e1e', 'moves') + key('#ffdc00', 'detection', 'sq');
    const names = hello.runs.length > 1 ? hello.runs : ['trajectory'];
    $('mapkey').innerHTML = names.map((name, i) => key(`var(--c${color(i)})`, escape(name))).join('') + (app.truth ? key('var(--truth)', 'ground truth') : '') + key('#ff1e1e', 'people') + key('var(--loop)', 'loop');
    reset();
    theme();
  }
  const escape = (text) => text.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);
  const color = (run) => (hello.runs.length > 1 ? run % 7 : 3);

  const take = {
    control(packet) {
      seen.control = packet.number;
      Object.assign(app, { paused: packet.paused, ended: packet.ended });
      $('play').textContent = app.paused ? 'Play' : 'Pause';
      if (document.activeElement !== $('speed')) $('speed').value = packet.speed;
      for (const id of ['play', 'step', 'speed']) $(id).disabled = app.ended;
      badge();
    },
    frame(packet) {
      seen.frame = packet.number;
      packet.ms = packet.times.reduce((a, b) => a + b, 0);
      // Not every frame is sent, but the figures of all are.
      for (const [, t, inliers, ms] of packet.ticks) { plots.t.push(t); plots.inliers.push(inliers); plots.ms.push(ms); }
      app.ticks += packet.ticks.length;
      if (plots.t.length > MAX_PLOT) for (const values of Object.values(plots)) values.splice(0, MAX_PLOT / 10);
      history.push(packet);
      kept += packet.image.byteLength;
      while (history.length > KEPT || kept > KEPT_BYTES) { kept -= history.shift().image.byteLength; if (past) past = Math.max(0, past - 1); }
      app.frames++;
      if (packet.loop) app.loops++;
      $('past').max = history.length - 1;
      if (past === null) { $('past').value = history.length - 1; show(packet); }
    },
    map(packet) {
      seen.map = packet.number;
      const positions = new Float32Array(packet.landmarks), poses = new Float32Array(packet.keyframes), stamps = new Float64Array(packet.stamps), edges = new Uint32Array(packet.edges);
      [app.points, app.keyframes, app.edges] = [positions.length / 3, stamps.length, edges.length / 3];
      keyframes = new Map();
      stamps.forEach((stamp, i) => keyframes.set(stamp, matrixOf(poses.subarray(7 * i, 7 * i + 7))));
      if (!scene) return;
      scene.points('landmarks', positions, new Uint8Array(packet.colors), { size: 0.012, least: 1.6 });
      const kinds = [[], [], []], one = (i) => [poses[7 * i], poses[7 * i + 1], poses[7 * i + 2]];
      for (let i = 0; i < edges.length; i += 3) kinds[edges[i + 2]].push(...one(edges[i]), ...one(edges[i + 1]));
      [['tree', 0.9], ['cov', 0.55], ['loop', 1]].forEach(([name, alpha], i) => {
        scene.lines('edges' + i, new Float32Array(kinds[i]), null, { color: yfColor('--' + name), alpha, name: '--' + name });
      });
      const small = [];
      for (const m of keyframes.values()) { const f = scene.frustum(hello.camera.width, hello.camera.height, hello.camera.fx, hello.camera.fy, 0.05); for (let i = 0; i < f.length; i += 3) small.push(...moved(m, f[i], f[i + 1], f[i + 2])); }
      scene.lines('keyframes', new Float32Array(small), null, { color: yfColor('--tree'), name: '--tree' });
      for (const [stamp, patch] of patches) place(stamp, patch);
      if (!scene.touched && positions.length > 30) fit();
      visibility();
    },
    path(packet) {
      const path = (paths[packet.run] = packet);
      path.xyz = new Float32Array(path.positions);
      path.t = new Float32Array(path.stamps);
      path.e = new Float32Array(path.errors);
      if (packet.run === app.run) { app.error = path.rmse; trueLine(); }
      $('errors').textContent = paths.map((p, i) => (p.rmse ? `${hello.runs[i]} ${(100 * p.rmse).toFixed(1)} cm` : null)).filter(Boolean).map((text, i) => (i ? '' : 'error (ATE, RMSE): ') + text).join(', ');
      if (!scene) return;
      const id = 'path' + packet.run, name = '--c' + color(packet.run);
      scene.lines(id, path.xyz, null, { color: yfColor(name), strip: true, name });
      scene.points(id + 'p', path.xyz, null, { color: yfColor(name), least: packet.run === app.run ? 3.4 : 2, round: true, name });
    },
    patch(packet) {
      seen.patch = packet.number;
      const patch = { points: new Int16Array(packet.points), colors: new Uint8Array(packet.colors) };
      patches.set(packet.t, patch);
      app.patches = patches.size;
      if (scene) place(packet.t, patch);
    },
  };

  function place(stamp, patch) {
    const id = 'patch' + stamp, m = keyframes.get(stamp), item = scene.items.get(id);
    // A keyframe that the map has dropped has no pose.
    if (!m) { if (item) item.visible = false; return; }
    if (item) Object.assign(item, { matrix: m, visible: $('dense').checked });
    else scene.points(id, patch.points, patch.colors, { matrix: m, unit: 0.001, size: 0.028, least: 1.2 }).visible = $('dense').checked;
    scene.redraw();
  }
  const moved = (m, x, y, z) => [0, 1, 2].map((i) => m[i] * x + m[4 + i] * y + m[8 + i] * z + m[12 + i]);
  function matrixOf([tx, ty, tz, x, y, z, w]) {
    return new Float32Array([1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0, 2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0, 2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0, tx, ty, tz, 1]);
  }
  function trueLine() {
    const path = paths[app.run];
    if (!scene || !app.truth || !path.truth) return;
    // What the run has not reached yet would only mislead.
    const stamps = new Float32Array(hello.stamps), last = path.t[path.t.length - 1] + 0.02;
    const end = stamps.findIndex((t) => t > last), all = new Float32Array(hello.truth);
    scene.lines('truth', end < 0 ? all : all.slice(0, 3 * end), null, { color: yfColor('--truth'), strip: true, matrix: new Float32Array(path.truth), name: '--truth' });
  }
  function fit() {
    const path = paths[app.run].xyz || [], marks = scene.items.get('landmarks');
    scene.fit(marks ? marks.positions : path, path);
  }
  function visibility() {
    if (!scene) return;
    for (const [id, item] of scene.items) {
      if (String(id).startsWith('edges') || id === 'keyframes') item.visible = $('graph').checked;
      if (String(id).startsWith('patch')) item.visible = $('dense').checked && keyframes.has(+id.slice(5));
    }
    scene.redraw();
  }

  // Shows a frame, now or from the past.
  async function show(packet) {
    shown = packet;
    app.shown = packet.number;
    Object.assign(app, { state: packet.state, reason: packet.reason, features: packet.features, movers: packet.movers.byteLength / 6, past: past !== null });
    badge();
    $('facts').textContent = `frame ${packet.number}${hello.frames ? ' of ' + hello.frames : ''}, ${packet.t.toFixed(2)} s · ${packet.inliers} inliers of ${packet.features} features · ${packet.keyframes} keyframes, ${packet.landmarks} landmarks · ${packet.ms.toFixed(1)} ms`;
    $('reason').hidden = !packet.reason;
    $('reason').textContent = packet.reason || '';
    $('when').textContent = past === null ? '' : `frame ${packet.number}, ${packet.t.toFixed(2)} s`;
    $('now').disabled = past === null;
    if (scene) {
      const m = packet.pose ? new Float32Array(packet.pose) : scene.pose, { width, height, fx, fy } = hello.camera;
      if (m) {
        scene.pose = m;
        scene.lines('camera', scene.frustum(width, height, fx, fy, 0.25), null, { color: yfColor(packet.pose ? '--good' : '--bad'), matrix: m });
        scene.points('movers', new Int16Array(packet.pose ? packet.movers : 0), null, { color: [1, 0.12, 0.12], matrix: m, unit: 0.001, size: 0.05, least: 2, alpha: 0.75 });
      }
    }
    draw();
    if (busy) return;
    busy = true;
    try {
      while (shown !== picture.of) {
        const of = shown, image = of.image.byteLength ? await createImageBitmap(new Blob([of.image], { type: 'image/jpeg' })) : null;
        paint(of, image);
        picture.of = of;
      }
    } catch (error) { picture.of = shown; }
    busy = false;
  }
  const picture = { of: null };
  function paint(packet, image) {
    const canvas = $('picture'), [w, h] = packet.size, g = canvas.getContext('2d');
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    if (image) { g.drawImage(image, 0, 0, w, h); image.close(); }
    const mask = new Uint8Array(packet.moving), [columns, rows] = packet.mask;
    if (mask.length) {
      g.fillStyle = 'rgba(255,30,30,.35)';
      const [cw, ch] = [w / columns, h / rows];
      for (let i = 0; i < mask.length; i++) if (mask[i]) g.fillRect((i % columns) * cw, (i / columns | 0) * ch, cw, ch);
    }
    g.lineWidth = 2;
    const outline = (list, style) => { g.strokeStyle = style; for (const [a, b, c, d] of list) g.strokeRect(a, b, c - a, d - b); };
    outline(packet.boxes, '#ffdc00');
    outline(packet.regions, '#ff1e1e');
    g.font = '14px system-ui,sans-serif';
    g.fillStyle = '#ffdc00';
    for (const [a, b, , , score] of packet.boxes) g.fillText(score.toFixed(2), a + 4, b + 15);
    const view = new DataView(packet.points);
    for (let at = 0; at < view.byteLength; at += 6) {
      const [x, y, trust, marks] = [view.getUint16(at, true), view.getUint16(at + 2, true), view.getUint8(at + 4) / 255, view.getUint8(at + 5)];
      const hue = 120 * trust;
      g.fillStyle = marks & 1 || trust < 0.99 ? `hsl(${hue},100%,${trust < 0.5 ? 56 : 60}%)` : '#008200';
      const r = marks & 1 || trust <= 0 ? 2 : 1.3;
      g.fillRect(x - r, y - r, 2 * r, 2 * r);
    }
  }
  let drawn = 0;
  function draw() {
    if (!plots) return;
    const now = performance.now();
    if (now - drawn < 150 && past === null) { clearTimeout(draw.later); draw.later = setTimeout(draw, 160); return; }
    drawn = now;
    const mark = past === null || !shown ? null : shown.t;
    yfPlot($('p0'), plots.t, plots.inliers, '--c3', mark);
    yfPlot($('p1'), plots.t, plots.ms, '--c2', mark);
    if (shown) { $('v0').textContent = shown.inliers; $('v1').textContent = shown.ms.toFixed(1); }
    const path = paths && paths[app.run];
    if (app.truth && path && path.t) {
      yfPlot($('p2'), path.t, path.e, '--c0', mark);
      $('v2').textContent = path.rmse ? 'RMSE ' + path.rmse.toFixed(3) : '';
    }
  }
  function badge() {
    const name = !app.connected ? (app.ended ? 'ended' : 'gone') : app.ended ? 'ended' : !shown ? 'waiting' : shown.state;
    const text = { gone: 'no connection', ended: 'the run has ended', waiting: 'waiting for frames' }[name] || name;
    $('state').className = 'badge ' + name;
    $('state').textContent = text + (app.paused && !app.ended ? ', paused' : '') + (past !== null ? ', looking back' : '');
  }
  function note() {
    if (!scene) return;
    $('note').textContent = `grid ${scene.grid} m`;
    for (const id of ['orbit', 'follow', 'top']) $(id).setAttribute('aria-pressed', scene.mode === id);
  }
  function theme() {
    if (!scene) return;
    scene.gridColor = yfColor('--grid');
    for (const [id, item] of scene.items) { if (item.name) item.color = yfColor(item.name); if (id === 'grid') item.color = scene.gridColor; }
    scene.redraw();
    draw();
  }

  const ask = (text) => fetch('control?' + text, { method: 'POST' }).catch(() => badge());
  $('play').onclick = () => ask('do=' + (app.paused ? 'play' : 'pause'));
  $('step').onclick = () => ask('do=step');
  $('speed').onchange = () => ask('do=speed&speed=' + $('speed').value);
  $('run').onchange = () => { app.run = +$('run').value; reset(); for (const path of paths) path.number = 0; $('past').value = $('past').max = 0; };
  $('past').oninput = () => { const i = +$('past').value; past = i < history.length - 1 ? i : null; if (history[i]) show(history[i]); };
  const live = () => { past = null; $('past').value = $('past').max; if (history.length) show(history[history.length - 1]); };
  $('now').onclick = live;
  for (const id of ['orbit', 'follow', 'top']) $(id).onclick = () => scene && scene.setMode(id);
  $('fit').onclick = () => { if (scene) { scene.touched = false; fit(); } };
  for (const id of ['dense', 'graph']) $(id).onchange = visibility;
  document.addEventListener('keydown', (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || ['SELECT', 'INPUT'].includes(e.target.tagName) || (e.target.tagName === 'BUTTON' && e.key === ' ')) return;
    const name = { 1: 'orbit', 2: 'follow', 3: 'top', f: 'fit', ' ': 'play', '.': 'step', l: 'now' }[e.key];
    if (name && !$(name).disabled && (hello && hello.can_pause || !['play', 'step'].includes(name))) { $(name).click(); e.preventDefault(); }
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', theme);
  new ResizeObserver(() => { drawn = 0; draw(); }).observe($('plots'));
  note();
  listen();
})();
