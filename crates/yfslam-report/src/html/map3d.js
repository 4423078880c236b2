// Shows the map of a report. In: yfMap, the data of the page. Out: a drawing on #map-canvas.
(() => {
  'use strict';
  const $ = (id) => document.getElementById('map-' + id);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const floats = (text) => new Float32Array(bytes(text).buffer);
  const scene = yfScene($('canvas'), () => {
    $('grid').textContent = 'grid ' + scene.grid + ' m';
    for (const mode of ['orbit', 'top']) $(mode).setAttribute('aria-pressed', scene.mode === mode);
  });
  window.yfMapScene = scene;
  if (!scene) { $('canvas').replaceWith('The map needs WebGL 2, which this browser does not offer.'); return; }
  const put = () => {
    scene.gridColor = yfColor('--ink-axis');
    yfMap.methods.forEach((method, i) => {
      const matrix = new Float32Array(method.matrix), color = yfColor(method.color);
      scene.points('landmarks' + i, floats(method.landmarks), bytes(method.colors), { matrix, size: 0.02, least: 2 });
      scene.points('keyframes' + i, floats(method.keyframes), null, { matrix, color, least: 5, round: true });
      scene.lines('path' + i, floats(method.path), null, { matrix, color, strip: true });
    });
    if (yfMap.truth) scene.lines('truth', floats(yfMap.truth.path), null, { matrix: new Float32Array(yfMap.truth.matrix), color: yfColor('--ink-truth'), strip: true });
    choose();
  };
  const choose = () => {
    yfMap.methods.forEach((_, i) => { for (const kind of ['landmarks', 'keyframes']) scene.items.get(kind + i).visible = i === +$('method').value; });
    scene.redraw();
  };
  const fit = () => { const i = $('method').value; scene.fit(scene.items.get('landmarks' + i).positions, scene.items.get('path' + i).positions); };
  put();
  fit();
  $('method').onchange = choose;
  $('fit').onclick = fit;
  for (const mode of ['orbit', 'top']) $(mode).onclick = () => scene.setMode(mode);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', put);
})();
