// The markerless reference in a real browser, against the program: a film of a real hand is the webcam, the twin wears the glove.
// What the program writes as camera.csv is compared with the marks on the same film. Nothing may be asked of another machine.
// Usage: node markerless_test.mjs PROGRAM FILM.mjpeg ANGLES.csv [--pictures FOLDER]     CHROMIUM names another browser.
// ANGLES.csv is what `flexor track` makes of the film with models/joints/green_markers.json.
import { readdirSync, readFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { check, finish, launchWithFilm, step, visit } from './browser_test.mjs';

const [program, film, tracked] = process.argv.slice(2).map((path) => resolve(path));

const webcam_hz = 30; // at which Chromium plays an MJPEG file, over and over
const filmed_s = 35;
const patience_s = 60;
// From this picture on the index finger is stretched beside a fist: the landmarker takes it for closed (docs/live.md).
const stretched = 280;
const leastFound = 0.7;
const leastCorrelation = 0.8;
// Against the marks, after the offset (docs/live.md). Less than half of it is too good to be true.
const stated_deg = { index_mcp: 6, index_pip: 11 };

function readCsv(file) {
  const [head, ...lines] = readFileSync(file, 'utf8').trim().split('\n');
  const names = head.split(',');
  const rows = lines.map((line) => line.split(',').map(Number));
  return Object.fromEntries(names.map((name, c) => [name, rows.map((row) => row[c])]));
}

// ---- the page

// What was asked for, and of each picture whether a hand was found.
function listen(page, url) {
  const asked = [];
  const found = [];
  page.on('websocket', (socket) => {
    socket.on('framesent', ({ payload }) => {
      const message = typeof payload === 'string' ? JSON.parse(payload) : {};
      if (message.do === 'angles') found.push(Object.keys(message.angles).length > 0);
    });
  });
  page.on('request', (request) => asked.push(request.url().replace(url, '')));
  return { asked, found };
}

// Runs in the page.
function isDrawnOn(canvas) {
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  return data.some((value) => value > 0);
}

async function calibrate(view, asked) {
  const { page } = view;
  const at = (id) => view.at(id);
  const model = () => asked.filter((path) => path.startsWith('markerless/'));
  await at('tab-calibrate').click();
  await at('calibrate-person').fill('Test');
  check('nothing of the model is loaded before it is chosen', model().length === 0);
  await at('calibrate-reference-markerless').check();
  check(
    'its error stands beside the choice',
    /14 degrees.*13/.test(await page.locator('.choices-reference').innerText()),
  );
  await at('calibrate-start').click();
  await step(view, 'reference');
  await at('camera-facts').filter({ hasText: 'hand found' }).waitFor();
  check(`the model is loaded from the page's own folder: ${model().join(' ')}`, model().length === 4);
  await at('calibrate-next').click();
  await step(view, 'motion');
  await page.waitForTimeout(filmed_s * 1000);
  check('the skeleton is drawn over the video', await at('camera-skeleton').evaluate(isDrawnOn));
  await view.picture('markerless_motion');
  await at('calibrate-next').click();
  await step(view, 'identify');
}

// ---- the angles

function correlation(a, b) {
  const mean = (x) => x.reduce((sum, v) => sum + v, 0) / x.length;
  const [ma, mb] = [mean(a), mean(b)];
  const products = (x, mx, y, my) => x.reduce((sum, v, i) => sum + (v - mx) * (y[i] - my), 0);
  return products(a, ma, b, mb) / Math.sqrt(products(a, ma, a, ma) * products(b, mb, b, mb));
}

// Which picture was shown at this time, if the film began at `begin_s`.
function pictureAt(t_s, begin_s, count) {
  const k = Math.round((t_s - begin_s) * webcam_hz) % count;
  return k < 0 ? k + count : k;
}

// When the film began, by the knuckle, of which the landmarker never loses sight.
function beginOf(seen, marks) {
  const all = marks.index_mcp_deg;
  let best = { r: -1, begin_s: 0 };
  for (let k = 0; k < all.length; ++k) {
    const begin_s = seen.t_s[0] + k / webcam_hz;
    const shown = seen.t_s.map((t) => all[pictureAt(t, begin_s, all.length)]);
    const r = correlation(seen.index_mcp_deg, shown);
    if (r > best.r) best = { r, begin_s };
  }
  return best.begin_s;
}

// Of the pictures before `end`.
function against(seen, marks, joint, begin_s, end) {
  const count = marks.t_s.length;
  const rows = seen.t_s.map((t, i) => ({ picture: pictureAt(t, begin_s, count), angle: seen[`${joint}_deg`][i] }));
  const kept = rows.filter(({ picture }) => picture < end);
  const truth = kept.map(({ picture }) => marks[`${joint}_deg`][picture]);
  const angles = kept.map(({ angle }) => angle);
  const error = angles.map((angle, i) => angle - truth[i]);
  const offset = error.reduce((sum, v) => sum + v, 0) / error.length;
  const rms = Math.sqrt(error.reduce((sum, v) => sum + (v - offset) ** 2, 0) / error.length);
  return { r: correlation(angles, truth), offset, rms };
}

const inWords = ({ r, offset, rms }) =>
  `r ${r.toFixed(3)}, ${rms.toFixed(1)} degrees rms about an offset of ${offset.toFixed(1)}`;

function compare(seen, marks) {
  const begin_s = beginOf(seen, marks);
  for (const [joint, stated] of Object.entries(stated_deg)) {
    const figures = against(seen, marks, joint, begin_s, stretched);
    check(
      `${joint} against the marks: ${inWords(figures)}`,
      figures.r > leastCorrelation && figures.rms < 1.4 * stated && figures.rms > 0.5 * stated,
    );
    console.log(`     of the whole film: ${inWords(against(seen, marks, joint, begin_s, Infinity))}`);
  }
}

const marks = readCsv(tracked);
const browser = await launchWithFilm(film);
const screen = { viewport: { width: 1280, height: 900 }, patience_s };
await visit(browser, program, ['--from', 'twin'], screen, async (view, url, sessions) => {
  const { asked, found } = listen(view.page, url);
  await view.page.goto(url);
  await calibrate(view, asked);
  const share = found.filter(Boolean).length / found.length;
  check(`a hand is found in ${Math.round(100 * share)} % of ${found.length} pictures`, share >= leastFound);
  const written = readdirSync(sessions, { recursive: true }).find((name) => name.endsWith('camera.csv'));
  const seen = readCsv(join(sessions, written));
  const rate_hz = seen.t_s.length / (seen.t_s.at(-1) - seen.t_s[0]);
  console.log(`${seen.t_s.length} angles, ${rate_hz.toFixed(1)} a second`);
  compare(seen, marks);
});
await browser.close();
finish();
