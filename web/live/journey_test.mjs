// The whole way in a real browser, against the program with both simulated boards: a glove that is found, a guided calibration
// with a film of the twin's hand as webcam, the model in the running glove, the hand's score before and after, the glove put on
// anew by eight degrees, ten seconds, and the score again.
// Usage: node journey_test.mjs PROGRAM FILM.mjpeg [--pictures FOLDER]        CHROMIUM names another browser.
import { mkdirSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { check, findings, finish, launchWithFilm, seconds, start, step, watch } from './browser_test.mjs';

const [program, film] = process.argv.slice(2);
const pictures = process.argv[4] === '--pictures' ? process.argv[5] : undefined;
if (pictures) mkdirSync(pictures, { recursive: true });

const longest_s = 240;
const slip_deg = 8;
const filmed_s = 90; // what the page asks for; the film has two minutes
// Of the published compensator's error on the same boards: what the experiment gives for one donning, from both sides.
const identifiedShare = [0.2, 0.85];
const anewShare = 1.35; // of the error before the glove was put on anew

class Walk {
  constructor(page) {
    this.page = page;
    this.pictures = 0;
  }

  at(id) {
    return this.page.getByTestId(id).first();
  }

  async picture(name) {
    if (!pictures) return;
    this.pictures += 1;
    await this.page.screenshot({ path: join(pictures, `${String(this.pictures).padStart(2, '0')}_${name}.png`) });
  }

  async says(id, words) {
    await this.at(id).filter({ hasText: words }).waitFor();
  }

  // The total in degree-seconds of what runs now.
  async score(label) {
    await this.at('tab-look').click();
    const before = await this.page.getByTestId('score-row').count();
    await this.at('score-label').fill(label);
    await this.at('score-run').click();
    await this.page.waitForFunction((n) => document.querySelectorAll('[data-testid="score-row"]').length > n, before);
    const row = await this.page.getByTestId('score-row').filter({ hasText: label }).first().innerText();
    const total = Number(row.replace(label, '').match(/[\d.]+/)[0]);
    console.log(`${seconds()} s  score ${label}: ${total} degree-seconds`);
    await this.picture(`score_${label.replaceAll(' ', '_')}`);
    return total;
  }

  // Into the glove that runs.
  async send() {
    await this.at('tab-wear').click();
    await this.at('send').click();
    await this.at('job').filter({ hasText: /[✓✕] Send/ }).waitFor();
    const end = await this.at('job').innerText();
    check(`the model is in the glove: ${end.replaceAll('\n', ' ')}`, end.includes('✓'));
    await this.picture('sent');
  }
}

async function firstVisit(walk) {
  const opened = Date.now();
  await walk.page.goto(url);
  await walk.at('card-index').waitFor();
  const first = await walk.at('card-index').textContent();
  await walk.page.waitForFunction(
    (was) => document.querySelector('[data-testid=card-index]')?.textContent !== was,
    first,
  );
  const moving_s = (Date.now() - opened) / 1000;
  check(`the glove moves ${moving_s.toFixed(1)} s after the page is opened, at most 5`, moving_s <= 5);
  await walk.says('next', 'Calibrate it');
  await walk.picture('first_visit');
}

async function calibrate(walk) {
  await walk.at('tab-calibrate').click();
  await walk.at('calibrate-person').fill('Test');
  await walk.at('calibrate-reference-marks').check({ force: true });
  await walk.at('calibrate-joints').selectOption('paper_hand');
  await walk.picture('calibrate');
  await walk.at('calibrate-start').click();
  await step(walk.page, 'reference');
  await walk.says('calibrate-say', 'The camera sees the marks');
  await walk.picture('reference');
  await walk.at('calibrate-next').click();
  await step(walk.page, 'motion');
  await walk.page.waitForTimeout((filmed_s * 1000) / 2);
  await walk.picture('motion');
  await walk.page.waitForTimeout((filmed_s * 1000) / 2);
  await walk.at('calibrate-next').click();
  await step(walk.page, 'result');
  const rows = await walk.at('result-table').innerText();
  console.log(rows);
  await walk.picture('result');
  await walk.at('calibrate-accept').click();
  await step(walk.page, 'send');
}

async function putOnAnew(walk) {
  await walk.at('tab-look').click();
  await walk.at('twin-slip_deg').fill(String(slip_deg));
  const slipped = await walk.score('slipped');
  await walk.at('tab-wear').click();
  await walk.at('anew-start').click();
  await walk.at('anew-accept').waitFor();
  console.log(await walk.at('anew-table').innerText());
  await walk.picture('anew');
  await walk.at('anew-accept').click();
  return slipped;
}

async function journey(page) {
  const walk = new Walk(page);
  await firstVisit(walk);
  const published = await walk.score('published');
  await calibrate(walk);
  await walk.send();
  const identified = await walk.score('identified');
  const share = identified / published;
  check(
    `identified ${share.toFixed(2)} of published, from ${identifiedShare[0]} to ${identifiedShare[1]}`,
    share >= identifiedShare[0] && share <= identifiedShare[1],
  );
  const slipped = await putOnAnew(walk);
  await walk.send();
  const anew = await walk.score('put on anew');
  check(`eight degrees cost ${(slipped / identified).toFixed(2)} times the error`, slipped > 1.2 * identified);
  const mended = (slipped - anew) / (slipped - identified);
  check(`${(100 * mended).toFixed(0)} % of what eight degrees cost is mended, at least half`, mended >= 0.5);
  check(`put on anew ${(anew / identified).toFixed(2)} times the error before, at most ${anewShare}`, anew <= anewShare * identified);
}

const sessions = pictures ? join(pictures, 'sessions') : mkdtempSync(join(tmpdir(), 'flexor-journey-'));
rmSync(sessions, { recursive: true, force: true });
const { live, url } = await start(program, ['--demo'], sessions);
const browser = await launchWithFilm(film);
try {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 } });
  page.setDefaultTimeout(90000); // the whole is timed
  watch(page, url);
  await journey(page);
  check(`done in ${seconds()} s, at most ${longest_s}`, Number(seconds()) <= longest_s);
} catch (error) {
  if (pictures) await browser.contexts()[0]?.pages()[0]?.screenshot({ path: join(pictures, 'failed.png'), fullPage: true });
  findings.push(error.message);
} finally {
  await browser.close();
  live.kill('SIGINT');
  await new Promise((ended) => live.once('exit', ended));
  if (!pictures) rmSync(sessions, { recursive: true, force: true });
}
finish();
