// Opens the live view and a report in headless Chromium, asserts on the state of the page, and writes screenshots.
//
//   tools/view/check.sh [PROGRAM] [FOLDER FOR SCREENSHOTS]
import { spawn } from 'node:child_process';
import { mkdtempSync, mkdirSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';

const { chromium } = createRequire(resolve(process.env.MODULES || 'target/view', 'x'))('playwright-core');

const [program, shots] = [process.argv[2] || 'target/release/yfslam', process.argv[3] || mkdtempSync(join(tmpdir(), 'yfslam-view-'))];
const data = process.env.YFSLAM_DATA;
mkdirSync(shots, { recursive: true });
const flags = ['--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
  '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM || '/usr/bin/chromium', args: flags });
let passed = 0;

// Starts the program and returns it with the address of its page.
function start(...args) {
  const out = mkdtempSync(join(tmpdir(), 'yfslam-run-'));
  const child = spawn(program, [...args, '--view=0', '-o', out]);
  const run = { child, out, text: '', ended: new Promise((done) => child.on('exit', done)) };
  run.url = new Promise((found, failed) => {
    child.stderr.on('data', (bytes) => {
      run.text += bytes;
      const match = /live view: (http:\S+)/.exec(run.text);
      if (match) found(match[1]);
    });
    child.on('exit', (code) => failed(new Error(`ended with ${code}: ${run.text}`)));
  });
  return run;
}

async function open(url, { width = 1280, height = 800, colorScheme = 'light', isMobile = false } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, colorScheme, isMobile, hasTouch: isMobile, deviceScaleFactor: isMobile ? 2 : 1 });
  const page = await context.newPage();
  page.problems = [];
  page.on('pageerror', (error) => page.problems.push(String(error)));
  page.on('console', (message) => ['error', 'warning'].includes(message.type()) && page.problems.push(message.text()));
  page.on('request', (request) => {
    if (!request.url().startsWith(url) && !/^(blob|data):/.test(request.url())) page.problems.push('loads ' + request.url());
  });
  await page.goto(url);
  return page;
}
const state = (page) => page.evaluate(() => {
  const { scene, ...rest } = window.yfslam;
  return { ...rest, draws: scene ? scene.draws : 0, mode: scene && scene.mode, yaw: scene && scene.yaw };
});
const shot = (page, name) => page.screenshot({ path: join(shots, name + '.png') });
// Whether an area of the canvas with the map has more than one colour.
const hasMap = (page) => page.evaluate(() => {
  const canvas = document.getElementById('scene');
  window.yfslam.scene.draw();
  const copy = document.createElement('canvas');
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const g = copy.getContext('2d');
  g.drawImage(canvas, 0, 0);
  const data = g.getImageData(0, 0, copy.width, copy.height).data;
  let drawn = 0;
  for (let i = 3; i < data.length; i += 4) drawn += data[i] > 0;
  return drawn / (data.length / 4);
});

async function check(name, work) {
  if (process.argv[4] && !name.includes(process.argv[4])) return;
  try {
    await work();
    passed++;
    console.log(`ok      ${name}`);
  } catch (error) {
    console.log(`FAILED  ${name}\n${error.stack}`);
    process.exitCode = 1;
  }
}

await check('demo: images, map, people and plots; keys, pause, step, looking back', async () => {
  const run = start('demo', '--frames', '90');
  const page = await open(await run.url);
  await page.waitForFunction(() => window.yfslam.shown > 60 && window.yfslam.points > 200 && window.yfslam.patches > 0, null, { timeout: 60000 });
  await page.keyboard.press('Space');
  await page.waitForFunction(() => window.yfslam.paused);
  await page.waitForTimeout(1500);
  const paused = await state(page);
  assert.equal(paused.gl, true, 'WebGL 2');
  assert.equal(paused.state, 'tracking');
  assert.ok(paused.features > 100 && paused.keyframes > 2 && paused.edges >= paused.keyframes - 1, JSON.stringify(paused));
  assert.ok(paused.truth > 50 && paused.error < 0.2, `error ${paused.error}`);
  await page.waitForTimeout(700);
  assert.equal((await state(page)).frames, paused.frames, 'a paused run shows no new frame');
  await page.keyboard.press('.');
  await page.waitForFunction((n) => window.yfslam.shown > n, paused.shown);
  assert.equal((await state(page)).shown, paused.shown + 1, 'a step is one frame');
  assert.ok((await hasMap(page)) > 0.01, 'the map is drawn');
  await shot(page, 'demo-light');
  // The picture of the readme.
  await page.screenshot({ path: join(shots, 'live-view.jpg'), type: 'jpeg', quality: 82 });
  await page.keyboard.press('3');
  assert.equal((await state(page)).mode, 'top');
  await page.waitForTimeout(200);
  assert.ok((await hasMap(page)) > 0.01, 'the map is drawn from above');
  await shot(page, 'demo-top');
  await page.keyboard.press('2');
  await page.waitForTimeout(200);
  assert.ok((await hasMap(page)) > 0.01, 'the map is drawn from behind the camera');
  await shot(page, 'demo-follow');
  await page.keyboard.press('1');
  await page.focus('#scene');
  const { yaw } = await state(page);
  await page.keyboard.press('ArrowLeft');
  assert.notEqual((await state(page)).yaw, yaw, 'arrow keys turn the map');
  await page.focus('#past');
  for (let i = 0; i < 5; i++) await page.keyboard.press('ArrowLeft');
  const past = await state(page);
  assert.ok(past.past && past.shown < paused.shown, JSON.stringify(past));
  await page.click('#now');
  assert.equal((await state(page)).past, false);
  await page.selectOption('#run', '0');
  await page.waitForFunction(() => window.yfslam.points > 200 && window.yfslam.run === 0);
  await page.selectOption('#run', '3');
  await page.click('#play');
  await page.waitForFunction(() => window.yfslam.ended, null, { timeout: 90000 });
  await page.waitForTimeout(300);
  await shot(page, 'demo-end');
  assert.equal(await run.ended, 0, run.text);
  assert.deepEqual(page.problems, []);
  assert.match(await page.textContent('#state'), /ended/);
  await page.context().close();
});

await check('report: map in three dimensions', async () => {
  const out = mkdtempSync(join(tmpdir(), 'yfslam-report-'));
  const child = spawn(program, ['demo', '--frames', '60', '-o', out, '--quiet']);
  assert.equal(await new Promise((done) => child.on('exit', done)), 0);
  for (const colorScheme of ['light', 'dark']) {
    const url = pathToFileURL(join(out, 'report.html')).href;
    const page = await open(url, { colorScheme, height: 1000 });
    await page.waitForFunction(() => window.yfMapScene && window.yfMapScene.draws > 0);
    const items = await page.evaluate(() => [...window.yfMapScene.items].map(([id, item]) => [id, item.count, item.visible]));
    assert.ok(items.find(([id, count, visible]) => id === 'landmarks3' && count > 300 && visible), JSON.stringify(items));
    assert.ok(items.find(([id, count, visible]) => id === 'landmarks0' && count > 100 && !visible), JSON.stringify(items));
    assert.ok(items.find(([id, count]) => id === 'truth' && count > 50), JSON.stringify(items));
    await (await page.$('#map3d')).screenshot({ path: join(shots, `report-map-${colorScheme}.png`) });
    await page.screenshot({ path: join(shots, `report-${colorScheme}.png`), fullPage: true });
    assert.deepEqual(page.problems, []);
    await page.context().close();
  }
});

await check('dark page, and a phone', async () => {
  const run = start('run', 'synth:walking_xyz?people=3&frames=60');
  const url = await run.url;
  const dark = await open(url, { colorScheme: 'dark' });
  const phone = await open(url, { width: 390, height: 844, isMobile: true });
  await dark.waitForFunction(() => window.yfslam.frames > 30 && window.yfslam.points > 200, null, { timeout: 60000 });
  await dark.keyboard.press('Space');
  await dark.waitForTimeout(1000);
  await shot(dark, 'synth-dark');
  await phone.screenshot({ path: join(shots, 'synth-phone.png'), fullPage: true });
  const width = await phone.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(width <= 390, `the page is ${width} px wide on a phone of 390`);
  assert.ok((await state(phone)).points > 200 && (await hasMap(phone)) > 0.01);
  await dark.keyboard.press('Space');
  assert.equal(await run.ended, 0, run.text);
  assert.deepEqual([...dark.problems, ...phone.problems], []);
  await dark.context().close();
  await phone.context().close();
});

if (data) await check('Bonn crowd', async () => {
  const run = start('run', join(data, 'rgbd/bonn_crowd_dev'), '--camera', 'bonn');
  const page = await open(await run.url, { width: 1440, height: 860 });
  await page.waitForFunction(() => window.yfslam.frames > 250 && window.yfslam.movers > 100, null, { timeout: 120000 });
  await page.keyboard.press('Space');
  await page.waitForTimeout(1500);
  const now = await state(page);
  assert.ok(now.points > 1000 && now.patches > 5 && now.error < 0.1, JSON.stringify(now));
  await shot(page, 'bonn-light');
  await page.keyboard.press('Space');
  await page.waitForFunction(() => window.yfslam.ended, null, { timeout: 120000 });
  await page.waitForTimeout(300);
  await shot(page, 'bonn-end');
  assert.equal(await run.ended, 0, run.text);
  assert.deepEqual(page.problems, []);
  await page.context().close();
});

await browser.close();
console.log(`${passed} passed, ${process.exitCode ? 1 : 0} failed; screenshots in ${shots}`);
