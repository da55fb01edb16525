// Opens the built page in Chromium against mock.mjs, as a phone and a desktop would, light and dark, and walks through it by
// keyboard. It looks for axe-core's serious findings, a page wider than its screen, anything fetched from elsewhere, anything
// that the Content-Security-Policy stopped; it measures weight, time to the first picture, and from message to drawn frame.
// A wait ends when what is waited for is there.
// Usage: node page_test.mjs [--short] [--pictures FOLDER]        CHROMIUM names another browser.
// --short: one screen, nothing measured in time: the page's clock goes on only where this test steps it.
import { existsSync, mkdirSync, readdirSync, readFileSync, statSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';
import { check, findings, finish, launch, watch } from './browser_test.mjs';
import { startMock } from './mock.mjs';

const require = createRequire(import.meta.url);
const dist = process.env.FLEXOR_PAGE_OUT ?? fileURLToPath(new URL('./dist', import.meta.url));
const heaviest_bytes = 1.5e6; // without what is loaded for the markerless reference alone
const hasMarkerless = existsSync(join(dist, 'markerless/hand_landmarker.task'));
const firstPicture_ms = 1000;
const frame_ms = 1000 / 60;
const patience_s = 60;
const isShort = process.argv.includes('--short');
const pictures = process.argv.includes('--pictures') ? process.argv.at(-1) : undefined;
if (pictures) mkdirSync(pictures, { recursive: true });

function filesOf(folder) {
  return readdirSync(folder).flatMap((name) => {
    const path = join(folder, name);
    return statSync(path).isDirectory() ? filesOf(path) : [path];
  });
}

function weigh() {
  const gzipped = (files) => files.reduce((sum, file) => sum + gzipSync(readFileSync(file)).length, 0);
  const isApart = (file) => file.startsWith(join(dist, 'markerless/'));
  const bytes = gzipped(filesOf(dist).filter((file) => !isApart(file)));
  console.log(`     the markerless reference: ${Math.round(gzipped(filesOf(dist).filter(isApart)) / 1000)} kB more`);
  check(
    `weighs ${Math.round(bytes / 1000)} kB gzipped, at most ${heaviest_bytes / 1000}`,
    bytes > 50e3 && bytes <= heaviest_bytes,
  );
}

// ---- a page under watch

async function open(browser, mock, { width, height, colorScheme, reducedMotion = 'no-preference' }) {
  const context = await browser.newContext({
    viewport: { width, height },
    colorScheme,
    reducedMotion,
    permissions: ['camera'],
  });
  context.setDefaultTimeout(patience_s * 1000);
  const page = await context.newPage();
  if (isShort) await page.clock.install();
  const where = `${width} px, ${colorScheme}`;
  watch(page, mock.url, where);
  page.on('websocket', (socket) => {
    if (!socket.url().startsWith(mock.url.replace('http', 'ws'))) findings.push(`${where}: opens ${socket.url()}`);
  });
  page.on('console', (message) => {
    if (message.type() === 'error' && !message.text().includes('WebSocket connection'))
      findings.push(`${where}: ${message.text()}`);
  });
  await page.addInitScript(() => {
    globalThis.tones = 0;
    const { start } = OscillatorNode.prototype;
    OscillatorNode.prototype.start = function (...when) {
      ++globalThis.tones;
      start.apply(this, when);
    };
    document.addEventListener('securitypolicyviolation', (event) => {
      console.error(`policy stops ${event.violatedDirective} ${event.blockedURI}`);
    });
  });
  await page.goto(mock.url, { waitUntil: 'commit' });
  if (isShort) await page.clock.pauseAt(Date.now() + 1000);
  return { context, page, where };
}

async function axe(page, where) {
  // Over the debugger and not as a script of the page, which the policy would stop.
  await page.evaluate(readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8'));
  let isDone = false;
  const run = page
    .evaluate(() => globalThis.axe.run(document, { resultTypes: ['violations'] }))
    .finally(() => (isDone = true));
  while (isShort && !isDone) await pass(page, 50);
  const { violations } = await run;
  const serious = violations.filter((v) => v.impact === 'serious' || v.impact === 'critical');
  for (const v of serious)
    findings.push(
      `${where}: ${v.impact}: ${v.id}: ${v.help}: ${v.nodes[0].target.join(' ')}: ${v.nodes[0].failureSummary ?? ''}`,
    );
  check(`${where}: axe finds nothing serious`, serious.length === 0);
}

async function layout(page, where) {
  const [wide, screen] = await page.evaluate(() => [
    document.documentElement.scrollWidth,
    document.documentElement.clientWidth,
  ]);
  check(`${where}: ${wide} px wide on ${screen} px`, wide <= screen);
}

async function inspect({ page, where }, name) {
  await layout(page, `${where}, ${name}`);
  await axe(page, `${where}, ${name}`);
  if (pictures)
    await page.screenshot({ path: join(pictures, `${name}_${where.replace(/[^a-z0-9]+/g, '_')}.png`), fullPage: true });
}

const by = (page, id) => page.getByTestId(id);
async function press(page, id, key = 'Enter') {
  await by(page, id).focus();
  await page.keyboard.press(key);
}
const pass = (page, time_ms) => (isShort ? page.clock.runFor(time_ms) : page.waitForTimeout(time_ms));
async function until(page, what, condition, argument) {
  for (let i = 0; isShort && i < 10 * patience_s && !(await page.evaluate(condition, argument)); ++i) {
    await pass(page, 100);
    await new Promise((done) => setTimeout(done, 20)); // for what the program says
  }
  try {
    await page.waitForFunction(condition, argument, { timeout: patience_s * 1000 });
    check(what, true);
  } catch {
    check(what, false);
  }
}

const says = (page, what, id, words) =>
  until(page, what, ([id, words]) => document.querySelector(`[data-testid=${id}]`)?.textContent?.includes(words), [id, words]);

const changes = (page, what, id, was) =>
  until(page, what, ([id, was]) => ![was, undefined].includes(document.querySelector(`[data-testid=${id}]`)?.textContent), [id, was]);

async function eventually(condition) {
  for (let i = 0; i < 10 * patience_s && !condition(); ++i) await new Promise((done) => setTimeout(done, 100));
  return condition();
}

// ---- what a person does

async function firstPicture({ page, where }) {
  await by(page, 'card-index').waitFor();
  const paint_ms = await page.evaluate(
    () => performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? Infinity,
  );
  if (!isShort)
    check(
      `${where}: first picture after ${Math.round(paint_ms)} ms, at most ${firstPicture_ms}`,
      paint_ms <= firstPicture_ms,
    );
  await page.locator('[data-testid=hand-canvas]').waitFor();
  await until(page, `${where}: the hand is drawn`, () => document.querySelector('.stage-message')?.hidden === true);
  const hand_ms = await page.evaluate(() => performance.now());
  if (!isShort)
    check(`${where}: a moving hand ${Math.round(hand_ms)} ms after opening, at most 5000`, hand_ms <= 5000);
}

async function latency({ page, where }) {
  await by(page, 'tab-look').click();
  await pass(page, 6000);
  await by(page, 'tab-wear').click();
  await pass(page, 6000); // so that its frames alone are counted
  await by(page, 'tab-look').click();
  await pass(page, 250);
  const ms = Number((await by(page, 'link-screen').textContent())?.replace(/[^0-9.]/g, ''));
  check(
    `${where}: from message to drawn frame ${ms} ms at the median, at most two frames (${(2 * frame_ms).toFixed(1)} ms)`,
    ms > 0 && ms <= 2 * frame_ms,
  );
  await by(page, 'tab-wear').click();
}

async function tabsByKeyboard({ page, where }) {
  const selected = () => page.evaluate(() => document.querySelector('[role=tab][aria-selected=true]')?.id);
  await by(page, 'tab-wear').focus();
  const seen = [await selected()];
  for (const key of ['ArrowRight', 'ArrowRight', 'ArrowRight', 'ArrowLeft', 'Home', 'End', 'Home']) {
    await page.keyboard.press(key);
    seen.push(await selected());
  }
  const wanted = ['wear', 'calibrate', 'look', 'wear', 'look', 'wear', 'look', 'wear'].map((name) => `tab-${name}`);
  check(`${where}: arrow keys, Home and End go through the places`, JSON.stringify(seen) === JSON.stringify(wanted));
  const outline = await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle);
  check(`${where}: the focus can be seen`, outline !== 'none');
}

async function wear({ page, where }, mock) {
  const before = await by(page, 'angle-index').textContent();
  await changes(page, `${where}: the index card moves`, 'angle-index', before);
  check(`${where}: says what to do next`, ((await by(page, 'next').textContent()) ?? '').length > 10);
  await press(page, 'record');
  await says(page, `${where}: records`, 'record', 'Stop');
  await press(page, 'record', 'Space');
  await says(page, `${where}: stops recording`, 'record', 'Start recording');
  await press(page, 'anew-start');
  await by(page, 'anew-index').waitFor();
  check(
    `${where}: before and after in degrees`,
    /8\.\d° ± 2\.\d°/.test((await by(page, 'anew-middle').textContent()) ?? ''),
  );
  await inspect({ page, where }, 'wear_anew');
  await press(page, 'anew-accept');
  await until(page, `${where}: accepted`, () => !document.querySelector('[data-testid=anew-accept]').checkVisibility());
  await press(page, 'tracking', 'Space');
  await until(page, `${where}: follows slow changes`, () => document.querySelector('[data-testid=tracking][aria-checked=true]'));
  await press(page, 'tracking', 'Space');
  await press(page, 'send');
  await says(page, `${where}: says that it was sent`, 'job', 'runs anna-left');
  check(
    `${where}: the program heard each word`,
    ['record.start', 'record.stop', 'anew.start', 'anew.accept', 'tracking.set', 'send'].every((word) =>
      mock.world.done.includes(word),
    ),
  );
}

// Percent closed, and degrees as the wearer calls them, of a hand that stands still.
async function closed({ page, where }, mock) {
  const [open, half] = [[92, 30, 30, 30, 30], [127, 69, 69, 69, 69]];
  const isShown = (wanted) =>
    ['angle', 'closed'].every((part, i) => document.querySelector(`[data-testid=${part}-thumb]`)?.textContent === wanted[i]);
  const shows = (what, ...wanted) => until(page, `${where}: ${what}: ${wanted}`, isShown, wanted);
  const call = async (degrees) => {
    await by(page, 'open-hand').fill(degrees);
    await page.keyboard.press('Tab');
  };
  mock.world.stands = half;
  await shows('half closed', '127°', '50 % closed');
  await call('0');
  await shows('an open hand is called 0', '35°', '50 % closed');
  mock.world.stands = open;
  await shows('an open hand', '0°', '0 % closed');
  await page.reload();
  await shows('as it was called before', '0°', '0 % closed');
  await call('');
  await shows('as the model has it', '92°', '0 % closed');
  mock.world.stands = null;
}

const tones = (page) => page.evaluate(() => globalThis.tones);

// In the motion, after a reload: nobody has touched the page yet.
async function tone({ page, where }, mock) {
  const change = async (what, tones) => {
    const asks = await by(page, 'calibrate-say').textContent();
    mock.world.calibration.seconds = mock.world.calibration.seconds > 30 ? 0 : 31;
    await changes(page, `${where}: another thing to do`, 'calibrate-say', asks);
    await pass(page, 1100); // from tone to tone
    check(`${where}: ${what}`, (await page.evaluate(() => globalThis.tones)) === tones);
  };
  await change('no tone before the page was touched', 0);
  await by(page, 'sound').click();
  await by(page, 'sound').click();
  await pass(page, 500);
  await change('a tone at a change', 1);
  await by(page, 'sound').click();
  await change('none where it is off', 1);
  await page.reload();
  await until(page, `${where}: silence is remembered`, () => document.querySelector('[data-testid=sound][aria-checked=false]'));
}

async function calibrate(view, mock, reference) {
  const { page, where } = view;
  const step = async (name) =>
    until(page, `${where}: step ${name}`, (id) => document.querySelector(id), `[data-testid=step-${name}][aria-current=step]`);
  await by(page, 'tab-calibrate').click();
  await press(page, 'calibrate-start');
  await says(page, `${where}: asks for a name`, 'calibrate-start-error', 'Write a name');
  await by(page, 'calibrate-person').focus();
  await page.keyboard.type('anna');
  check(
    `${where}: the markerless reference is ${hasMarkerless ? '' : 'not '}offered`,
    (await by(page, 'calibrate-reference-markerless').isEnabled()) === hasMarkerless,
  );
  await by(page, `calibrate-reference-${reference}`).check();
  await inspect(view, `calibrate_start_${reference}`);
  await press(page, 'calibrate-start');
  await step('glove');
  await press(page, 'calibrate-next');
  await step('reference');
  await page.keyboard.press('Enter');
  await step('motion');
  await pass(page, 2500);
  await inspect(view, `calibrate_motion_${reference}`);
  await until(
    page,
    `${where}: says what is missing`,
    () => (document.querySelector('[data-testid=missing-index]')?.textContent ?? '').length > 5,
  );
  if (reference === 'marks') {
    const { pictures: sent } = mock.world;
    const times = sent.map((p) => p.captured_s);
    const rate = (sent.length - 1) / (times[times.length - 1] - times[0]);
    check(
      `${where}: ${sent.length} JPEGs sent, ${rate.toFixed(1)} a second, in time's order`,
      sent.length > 10 &&
        rate > 3 && // a machine that does much else takes fewer
        rate < 21 &&
        sent.every((p) => p.jpeg && p.bytes < 512 * 1024) &&
        times.every((t, i) => i === 0 || t > times[i - 1]),
    );
  } else if (reference === 'markerless') {
    check(`${where}: pictures are looked at in the page`, await eventually(() => mock.world.looked > 10));
    check(`${where}: no picture leaves the page`, mock.world.pictures.length === 0);
  } else if (reference === 'drawn') {
    await until(
      page,
      `${where}: shows the program's picture`,
      () => document.querySelector('[data-testid=server-picture]')?.naturalWidth > 100,
    );
  }
  await page.reload();
  await step('motion');
  check(
    `${where}: opened again in the place where it was`,
    (await page.evaluate(() => document.querySelector('[role=tab][aria-selected=true]')?.id)) === 'tab-calibrate',
  );
  await says(page, `${where}: says what follows, and when`, 'calibrate-then', ' s: ');
  await tone(view, mock);
  await by(page, 'calibrate-back').click();
  await step('reference');
  await by(page, 'calibrate-next').click();
  await step('motion');
  mock.world.isHeld = true; // until the page was looked at
  await by(page, 'calibrate-next').click();
  await step('identify');
  await inspect(view, `calibrate_identify_${reference}`);
  mock.world.isHeld = false;
  await step('result');
  await by(page, 'result-index').waitFor();
  if (reference === 'poses') {
    check(`${where}: nothing measured has no plot`, !(await by(page, 'plot-ring').isVisible()));
  } else {
    await by(page, 'plot-ring').click();
    await says(page, `${where}: another finger's plot`, 'result-plot-caption', 'Ring');
  }
  await pass(page, 400);
  await inspect(view, `calibrate_result_${reference}`);
  await by(page, 'calibrate-accept').click();
  await step('send');
  await by(page, 'calibrate-send').click();
  await inspect(view, `calibrate_send_${reference}`);
  await by(page, 'calibrate-next').click();
  await by(page, 'calibrate-start').waitFor();
}

async function look(view, mock) {
  const { page, where } = view;
  await by(page, 'tab-look').click();
  await by(page, 'scope-angle-index').waitFor();
  await pass(page, 1500);
  await by(page, 'marker-text').fill('thumb out');
  await by(page, 'marker').click();
  await until(page, `${where}: marker taken`, () => document.querySelector('[data-testid=marker-text]')?.value === '');
  await by(page, 'scope-pause').click();
  const frozen = await by(page, 'scope-angle-index').textContent();
  await pass(page, 500);
  check(`${where}: a paused scope stands still`, (await by(page, 'scope-angle-index').textContent()) === frozen);
  await by(page, 'scope-in').click();
  await by(page, 'scope-pause').click();
  await by(page, 'twin-slip_deg').focus();
  for (let i = 0; i < 16; ++i) await page.keyboard.press('ArrowRight');
  check(`${where}: slip of 8 degrees reaches the twin`, await eventually(() => mock.world.twin.slip_deg === 8));
  await by(page, 'score-label').fill('worn 8 degrees off');
  const rows = await by(page, 'score-row').count();
  await by(page, 'twin-slip_deg').fill('6');
  await by(page, 'score-run').click();
  await until(page, `${where}: a score more`, (n) => document.querySelectorAll('[data-testid=score-row]').length > n, rows);
  check(
    `${where}: a score is of what the sliders show`,
    mock.world.twin.slip_deg === 6 && mock.world.done.lastIndexOf('twin.set') < mock.world.done.indexOf('score.run'),
  );
  mock.world.isHeld = true;
  await by(page, 'experiment-run').click();
  await by(page, 'strip-cancel').click();
  mock.world.isHeld = false;
  await by(page, 'flash').click();
  await says(page, `${where}: what goes wrong stands at its control`, 'flash-error', 'no board answers');
  const link = await page.locator('.files a').first().getAttribute('href');
  check(`${where}: files lie under files/`, link?.startsWith('files/2026-11-24_1530_anna/') === true);
  await by(page, 'replay-2026-11-24_1530_anna').click();
  await by(page, 'replay-line').waitFor();
  await press(page, 'replay-line', 'End');
  check(`${where}: the time line seeks`, await eventually(() => mock.world.done.includes('replay.seek')));
  await inspect(view, 'look');
  await by(page, 'replay-leave').click();
  mock.world.twin.slip_deg = 0;
}

async function lostAndFound({ page, where }, mock) {
  await by(page, 'tab-wear').click();
  mock.drop();
  await pass(page, 1500);
  await until(
    page,
    `${where}: connected again after the program was gone`,
    () =>
      document.querySelector('[data-testid=lost]')?.hidden === true &&
      document.querySelector('[data-testid=status]')?.textContent === 'Simulated boards',
  );
  mock.world.device = 'none';
  await says(page, `${where}: says that there is no glove`, 'next', 'Plug in the glove.');
  await inspect({ page, where }, 'wear_no_glove');
  await by(page, 'device-connect').click();
  await says(page, `${where}: connects`, 'status', 'Simulated boards');
}

// ---- the whole walk

async function gone(browser) {
  const mock = await startMock({ dist });
  const view = await open(browser, mock, { width: 1280, height: 800, colorScheme: 'light' });
  await by(view.page, 'card-index').waitFor();
  await until(view.page, 'draws the hand', () => document.querySelector('.stage-message')?.hidden === true);
  await mock.close();
  await until(view.page, 'says that the program is gone', () => document.querySelector('[data-testid=lost]').checkVisibility());
  if (pictures) await view.page.screenshot({ path: join(pictures, 'wear_lost.png') });
  await view.context.close();
}

async function main() {
  weigh();
  const browser = await launch('--enable-unsafe-swiftshader');
  await (await browser.newPage()).goto('about:blank'); // a browser in use has long started
  const screens = [
    { width: 1280, height: 800, colorScheme: 'light', reference: 'marks' },
    { width: 390, height: 844, colorScheme: 'dark', reference: 'drawn', reducedMotion: 'reduce' },
    { width: 1280, height: 800, colorScheme: 'dark', reference: 'poses' },
    { width: 390, height: 844, colorScheme: 'light', reference: hasMarkerless ? 'markerless' : 'marks' },
  ];
  for (const screen of isShort ? [screens[2]] : screens) {
    const mock = await startMock({ dist, speed: 5, camera: 'page' });
    const view = await open(browser, mock, screen);
    try {
      await firstPicture(view);
      if (screen === screens[0]) await latency(view);
      await tabsByKeyboard(view);
      await pass(view.page, 1200);
      await inspect(view, 'wear');
      await closed(view, mock);
      await wear(view, mock);
      await calibrate(view, mock, screen.reference);
      await look(view, mock);
      await lostAndFound(view, mock);
    } catch (error) {
      check(`${view.where}: ${String(error).split('\n').slice(0, 3).join(' ')}`, false);
      if (pictures)
        await view.page.screenshot({
          path: join(pictures, `failed_${view.where.replace(/[^a-z0-9]+/g, '_')}.png`),
          fullPage: true,
        });
    }
    await view.context.close();
    await mock.close();
  }
  if (!isShort) await gone(browser);
  await browser.close();
  finish();
}

await main();
