// Opens the page of `flexor live --demo` in Chromium, as a phone and a desktop would, light and dark, and walks through it by
// keyboard. It looks for axe-core's serious findings, a page wider than its screen, anything fetched from elsewhere, anything
// that the Content-Security-Policy stopped; it measures weight, time to the first picture, and from message to drawn frame.
// A wait ends when what is waited for is there.
// Usage: node page_test.mjs PROGRAM PAGE [--short] [--pictures FOLDER]        CHROMIUM names another browser.
// PAGE: the folder of the built page. --short: one screen, nothing measured in time.
import { existsSync, mkdtempSync, readdirSync, readFileSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { gzipSync } from 'node:zlib';
import { check, findings, finish, launch, seriousFindings, step, visit } from './browser_test.mjs';

const [program, built] = process.argv.slice(2);
const isShort = process.argv.includes('--short');
const hasMarkerless = existsSync(join(built, 'markerless/hand_landmarker.task'));
const heaviest_bytes = 1.5e6; // without what is loaded for the markerless reference alone

function filesOf(folder) {
  return readdirSync(folder).flatMap((name) => {
    const path = join(folder, name);
    return statSync(path).isDirectory() ? filesOf(path) : [path];
  });
}

function weigh() {
  const own = filesOf(built).filter((file) => !file.startsWith(join(built, 'markerless/')));
  const bytes = own.reduce((sum, file) => sum + gzipSync(readFileSync(file)).length, 0);
  check(
    `weighs ${Math.round(bytes / 1000)} kB gzipped, at most ${heaviest_bytes / 1000}`,
    bytes > 50e3 && bytes <= heaviest_bytes,
  );
}

async function press(view, id, key = 'Enter') {
  await view.at(id).focus();
  await view.page.keyboard.press(key);
}

async function inspect(view, name) {
  const [wide, screen] = await view.page.evaluate(() => [
    document.documentElement.scrollWidth,
    document.documentElement.clientWidth,
  ]);
  view.check(`${name}: ${wide} px wide on ${screen} px`, wide <= screen);
  const cut = await view.page.$$eval('.scroll', (all) => all.filter((one) => one.scrollWidth > one.clientWidth).length);
  view.check(`${name}: ${cut} tables wider than the screen`, cut === 0);
  const serious = await seriousFindings(view.page);
  findings.push(...serious.map((finding) => `${view.where}: ${name}: ${finding}`));
  view.check(`${name}: axe finds nothing serious`, serious.length === 0);
  await view.picture(name);
}

// With a socket that can be closed, and tones that are counted.
async function open(view, url) {
  await view.page.routeWebSocket(/socket$/, (socket) => {
    socket.connectToServer();
    view.socket = socket;
  });
  await view.page.addInitScript(() => {
    globalThis.tones = 0;
    const { start: sound } = OscillatorNode.prototype;
    OscillatorNode.prototype.start = function (...when) {
      ++globalThis.tones;
      sound.apply(this, when);
    };
  });
  await view.page.goto(url, { waitUntil: 'commit' });
}

// ---- what a person does

async function firstPicture(view) {
  await view.at('card-index').waitFor();
  const paint_ms = await view.page.evaluate(
    () => performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? Infinity,
  );
  await view.at('hand-canvas').waitFor();
  await view.until(() => document.querySelector('.stage-message')?.hidden === true);
  const hand_ms = await view.page.evaluate(() => performance.now());
  if (isShort) return;
  console.log(`first picture after ${Math.round(paint_ms)} ms, a moving hand after ${Math.round(hand_ms)}`);
}

async function latency(view) {
  await view.click('tab-look', 'tab-wear');
  await view.page.waitForTimeout(6000); // so that its frames alone are counted
  await view.click('tab-look');
  await view.expectText('link-screen', 'ms');
  const ms = Number((await view.at('link-screen').textContent())?.replace(/[^0-9.]/g, ''));
  view.check(`from message to drawn frame ${ms} ms at the median`, ms > 0);
  await view.click('tab-wear');
}

async function tabsByKeyboard(view) {
  const selected = () => view.page.evaluate(() => document.querySelector('[role=tab][aria-selected=true]')?.id);
  await view.at('tab-wear').focus();
  const seen = [await selected()];
  for (const key of ['ArrowRight', 'ArrowRight', 'ArrowRight', 'ArrowLeft', 'Home', 'End', 'Home']) {
    await view.page.keyboard.press(key);
    seen.push(await selected());
  }
  const wanted = ['wear', 'calibrate', 'look', 'wear', 'look', 'wear', 'look', 'wear'].map((name) => `tab-${name}`);
  view.check('arrow keys, Home and End go through the places', JSON.stringify(seen) === JSON.stringify(wanted));
  const outline = await view.page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle);
  view.check('the focus can be seen', outline !== 'none');
}

async function wear(view) {
  await view.changes('raw-index', await view.at('raw-index').textContent());
  view.check('no quality before there is a model', (await view.at('quality-index').textContent()) === 'not known');
  view.check('states what to do next', ((await view.at('next').textContent()) ?? '').length > 10);
  await press(view, 'record');
  await view.expectText('record', 'Stop');
  await view.click('tab-look');
  await view.at('marker-text').fill('thumb out');
  await view.click('marker');
  await view.until(() => document.querySelector('[data-testid=marker-text]')?.value === '');
  await view.click('tab-wear');
  await press(view, 'record', 'Space');
  await view.expectText('record', 'Start recording');
  await inspect(view, 'wear');
}

async function begin(view, reference) {
  await view.click('tab-calibrate');
  view.check('a right hand until somebody chooses otherwise', await view.at('calibrate-side-right').isChecked());
  await press(view, 'calibrate-start');
  await view.expectText('calibrate-start-error', 'Write a name');
  await view.at('calibrate-person').focus();
  await view.page.keyboard.type('anna');
  view.check(
    `the markerless reference is ${hasMarkerless ? '' : 'not '}offered`,
    (await view.at('calibrate-reference-markerless').isEnabled()) === hasMarkerless,
  );
  await view.at(`calibrate-reference-${reference}`).check();
  if (reference === 'marks') await view.expectText('marks-chosen', '24 dots');
  await inspect(view, `calibrate_start_${reference}`);
  await press(view, 'calibrate-start');
}

const tones = (view) => view.page.evaluate(() => globalThis.tones);

async function poses(view) {
  await step(view, 'motion');
  await view.expectText('calibrate-then', ' s: ');
  await view.expectText('calibrate-say', /^(Hold|Make|Open)/);
  const [asks, before] = [await view.at('calibrate-say').textContent(), await tones(view)];
  await view.changes('calibrate-say', asks);
  view.check('a tone at a change', (await tones(view)) > before);
  await view.click('sound');
  await view.page.reload();
  await step(view, 'motion');
  await view.until(() => document.querySelector('[data-testid=sound][aria-checked=false]'));
  view.check('opened again in the place where it was, and as silent', (await view.at('tab-calibrate').getAttribute('aria-selected')) === 'true');
  await inspect(view, 'calibrate_motion');
  await view.expectText('calibrate-say', 'Enough');
  view.check('no tone where it is off', (await tones(view)) === 0);
  await view.click('calibrate-next');
  await step(view, 'result');
  await view.at('result-index').waitFor();
  view.check('nothing measured has no plot', !(await view.at('plot-ring').isVisible()));
  await inspect(view, 'calibrate_result');
  await view.page.setViewportSize({ width: 390, height: 844 });
  await inspect(view, 'calibrate_result_phone');
  await view.page.setViewportSize({ width: 1280, height: 800 });
  await view.click('calibrate-accept');
  await step(view, 'send');
  await view.click('calibrate-send');
  await view.expectText('calibrate-say', 'Finish');
  await inspect(view, 'calibrate_send');
  await view.click('calibrate-next');
  await view.at('next').waitFor(); // the calibrated hand, no empty form
}

async function reference(view, kind) {
  await step(view, 'reference');
  if (kind === 'drawn') {
    await view.expectText('calibrate-say', 'The camera sees the marks');
    await view.until(() => document.querySelector('[data-testid=server-picture]')?.naturalWidth > 100);
    await view.until(() => document.querySelectorAll('[data-testid=camera-marks] circle').length === 24);
    view.check('each mark that is seen has a ring', true);
    await view.click('calibrate-next');
    await step(view, 'motion');
    await view.until(() => (document.querySelector('[data-testid=missing-index]')?.textContent ?? '').length > 5);
    await view.page.reload();
    await step(view, 'motion');
    await inspect(view, 'calibrate_motion_drawn');
    await view.click('calibrate-back');
    await step(view, 'reference');
  } else {
    await view.expectText('calibrate-say', kind === 'marks' ? 'sees every mark' : 'Show the whole hand');
    if (kind === 'marks') {
      await view.expectText('camera-facts', /[1-9]\d* pictures, \d of \d+ marks seen/);
      await view.expectText('marks-wanted', '24 dots');
    }
    view.check('Next waits for what the camera is to see', !(await view.at('calibrate-next').isEnabled()));
    await inspect(view, `calibrate_reference_${kind}`);
  }
  await view.click('calibrate-cancel');
  await view.at('calibrate-start').waitFor();
  await view.click('tab-look');
  await view.at('session').waitFor();
  const left = kind === 'drawn' ? 2 : 1; // its motion was recorded
  await view.until((n) => document.querySelectorAll('[data-testid=session]').length === n, left);
  view.check('a calibration that is cancelled before its motion leaves nothing', true);
  const height = await view.page.locator('.scopes').evaluate((element) => element.clientHeight);
  view.check(`scopes ${height} px high, at most 1200`, height <= 1200);
}

// With the model of two poses.
async function wearModel(view) {
  await view.click('tab-wear');
  await view.expectText('closed-index', '% closed');
  await view.at('open-hand').fill('0');
  await view.page.keyboard.press('Tab');
  await view.page.reload();
  await view.expectText('closed-index', '% closed');
  view.check('an open hand is called as before', (await view.at('open-hand').inputValue()) === '0');
  await press(view, 'anew-start');
  await view.at('anew-progress').waitFor();
  await view.at('anew-index').waitFor();
  await inspect(view, 'wear_anew');
  await press(view, 'anew-keep');
  await view.at('anew-start').waitFor();
  await press(view, 'send');
  await view.expectText('job', '✓ Send');
}

async function look(view) {
  await view.click('tab-look');
  await view.at('scope-angle-index').waitFor();
  await view.click('scope-pause');
  const frozen = await view.at('scope-angle-index').textContent();
  await view.page.waitForTimeout(500);
  view.check('a paused scope stands still', (await view.at('scope-angle-index').textContent()) === frozen);
  await view.click('scope-in', 'scope-pause');
  const worn = await view.score('as calibrated');
  await view.at('twin-slip_deg').focus();
  for (let i = 0; i < 16; ++i) await view.page.keyboard.press('ArrowRight');
  const slipped = await view.score('worn 8 degrees off');
  view.check(`a score is of what the sliders show: ${worn}, then ${slipped}`, slipped > 1.1 * worn);
  await view.at('twin-slip_deg').fill('0');
  await view.at('experiment-trials').fill('10000');
  await view.click('experiment-run', 'strip-cancel');
  await view.expectText('job', '✕ Experiment');
  await view.at('experiment-trials').fill('1');
  await view.click('experiment-run');
  await view.expectText('experiment-result', /raw\d+published-w\d+published-hw\d+/);
  view.check('no board is offered where there is none', !(await view.at('flash').isVisible()));
  const link = await view.page.locator('.files a').first().getAttribute('href');
  view.check('files lie under files/', link?.startsWith('files/') === true);
  await view.page.locator('[data-testid^=replay-2]').last().click();
  await view.at('replay-line').waitFor();
  await press(view, 'replay-line', 'End');
  await inspect(view, 'look');
  await view.click('replay-leave');
  await view.expectText('status', 'Simulated glove'); // it is back
}

async function lostAndFound(view) {
  await view.click('tab-wear');
  view.socket.close();
  await view.expectText('status', 'Not connected');
  await view.expectText('status', 'Simulated glove');
  view.check('connected again', true);
  await view.click('device-leave');
  await view.expectText('status', 'No glove');
  await inspect(view, 'wear_no_glove');
  await view.click('device-connect');
  await view.expectText('status', 'Simulated glove');
}

// A glove whose columns have no names is asked for them once.
async function unnamed(browser) {
  const sessions = mkdtempSync(join(tmpdir(), 'flexor-page-'));
  const log = join(sessions, 'log.txt');
  const rows = Array.from({ length: 500 }, (_, k) => {
    const [s, ms] = [Math.floor(k / 50), 20 * (k % 50)].map((n, i) => String(n).padStart(2 + i, '0'));
    return `12:00:${s}.${ms} -> ${400 + (k % 100)} ${500 + (k % 90)}`;
  });
  writeFileSync(log, `${rows.join('\n')}\n`);
  const screen = { viewport: { width: 1280, height: 800 } };
  for (const isFirst of [true, false]) {
    const name = async (view, url) => {
      await open(view, url);
      if (isFirst) {
        await view.at('name-column1').selectOption('index');
        await view.at('name-column2').selectOption('index');
        await view.click('names-save');
        await view.expectText('names-error', 'twice');
        await view.at('name-column2').selectOption('ring');
        await inspect(view, 'names');
        await view.click('names-save');
      }
      await view.at('card-ring').waitFor();
      await view.at('names').waitFor({ state: 'hidden' });
      view.check(isFirst ? 'columns get names' : 'and keep them for this glove', true);
    };
    await visit(browser, program, ['--from', log], screen, name, join(sessions, 'kept'));
  }
  rmSync(sessions, { recursive: true, force: true });
}

// ---- the whole walk

async function walk(view, kind, isFirst) {
  await firstPicture(view);
  if (isFirst && !isShort) await latency(view);
  await tabsByKeyboard(view);
  await wear(view);
  await begin(view, kind);
  if (kind !== 'poses') return reference(view, kind);
  await poses(view);
  await wearModel(view);
  await look(view);
  await lostAndFound(view);
}

weigh();
const browser = await launch('--enable-unsafe-swiftshader');
await (await browser.newPage()).goto('about:blank'); // a browser in use has long started
await unnamed(browser);
const [desktop, phone] = [{ width: 1280, height: 800 }, { width: 390, height: 844 }];
const screens = [
  ['poses', { viewport: desktop, colorScheme: 'light' }],
  ['drawn', { viewport: phone, colorScheme: 'dark', reducedMotion: 'reduce' }],
  ['marks', { viewport: desktop, colorScheme: 'dark' }],
  [hasMarkerless ? 'markerless' : 'marks', { viewport: phone, colorScheme: 'light' }],
];
for (const [kind, screen] of isShort ? screens.slice(0, 1) : screens) {
  await visit(browser, program, ['--demo'], screen, async (view, url) => {
    await open(view, url);
    await walk(view, kind, kind === 'poses');
  });
}
await browser.close();
finish();
