// What the tests in a browser share: the browser, the program, what they find.
import { spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createInterface } from 'node:readline';
import { chromium } from 'playwright-core';

export const option = (name) => (process.argv.includes(name) ? process.argv[process.argv.indexOf(name) + 1] : undefined);
const pictures = option('--pictures');
if (pictures) mkdirSync(pictures, { recursive: true });

// With a webcam: a film, or Chromium's own.
export function launch(...more) {
  const webcam = ['--use-fake-ui-for-media-stream', '--use-fake-device-for-media-stream'];
  const executablePath = process.env.CHROMIUM ?? '/usr/bin/chromium';
  return chromium.launch({ executablePath, args: ['--no-sandbox', ...webcam, ...more] });
}
export const launchWithFilm = (film) => launch(`--use-file-for-fake-video-capture=${film}`);

const begin_ms = Date.now();
export const seconds = () => ((Date.now() - begin_ms) / 1000).toFixed(1);
export const findings = [];
export function check(what, good) {
  console.log(`${seconds()} s  ${good ? 'ok  ' : 'BAD '} ${what}`);
  if (!good) findings.push(what);
}

// A page that asks for nothing but its own, and in which nothing is thrown.
export function watch(page, url, where = 'the page') {
  const isOwn = (address) => [url, 'blob:', 'data:'].some((begin) => address.startsWith(begin));
  page.on('request', (request) => isOwn(request.url()) || findings.push(`${where}: fetches ${request.url()}`));
  page.on('pageerror', (error) => findings.push(`${where}: ${error.message}`));
}

// What axe-core finds serious. It runs over the debugger and not as a script of the page, which the policy would stop.
export async function seriousFindings(page) {
  await page.evaluate(readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8'));
  const { violations } = await page.evaluate(() => globalThis.axe.run(document, { resultTypes: ['violations'] }));
  return violations
    .filter((v) => v.impact === 'serious' || v.impact === 'critical')
    .map((v) => `${v.id}: ${v.help}: ${v.nodes[0].target.join(' ')}: ${v.nodes[0].failureSummary ?? ''}`);
}

// A page under watch, by its data-testid.
export class View {
  constructor(page, where = 'the page') {
    this.page = page;
    this.where = where;
  }
  at(id) {
    return this.page.getByTestId(id).first();
  }
  check(what, good) {
    check(`${this.where}: ${what}`, good);
  }
  async click(...ids) {
    for (const id of ids) await this.at(id).click();
  }
  expectText(id, words) {
    return this.at(id).filter({ hasText: words }).waitFor();
  }
  async picture(name) {
    const path = pictures && join(pictures, `${name}_${this.where.replace(/[^a-z0-9]+/g, '_')}.png`);
    if (path) await this.page.screenshot({ path, fullPage: true });
  }
  until(condition, argument) {
    return this.page.waitForFunction(condition, argument);
  }
  changes(id, was) {
    return this.until(
      ([name, text]) => ![text, undefined].includes(document.querySelector(`[data-testid=${name}]`)?.textContent),
      [id, was],
    );
  }
  // The total in degree-seconds of what runs now.
  async score(label) {
    const rows = await this.page.getByTestId('score-row').count();
    await this.at('score-label').fill(label);
    await this.click('score-run');
    await this.until((n) => document.querySelectorAll('[data-testid=score-row]').length > n, rows);
    return Number(await this.page.locator('[data-testid=score-row] .total').nth(rows).textContent());
  }
}

export function finish() {
  for (const finding of findings) console.log(`finding: ${finding}`);
  console.log(findings.length === 0 ? 'nothing serious' : `${findings.length} findings`);
  process.exit(findings.length > 0 ? 1 : 0);
}

async function start(program, from, sessions) {
  const live = spawn(program, ['live', ...from, '--sessions', sessions, '--json'], { stdio: ['ignore', 'pipe', 'inherit'] });
  for await (const line of createInterface({ input: live.stdout })) return { live, url: JSON.parse(line).url };
  throw new Error('flexor live ended before it printed its address');
}

// Under watch: what it fetches and opens, what is thrown, what the Content-Security-Policy stops.
async function open(browser, url, { patience_s = 60, ...screen }) {
  const context = await browser.newContext({ permissions: ['camera'], ...screen });
  context.setDefaultTimeout(1000 * patience_s);
  const page = await context.newPage();
  const view = new View(page, `${screen.viewport.width} px, ${screen.colorScheme ?? 'light'}`);
  watch(page, url, view.where);
  page.on('websocket', (socket) => {
    if (!socket.url().startsWith(url.replace('http', 'ws'))) findings.push(`${view.where}: opens ${socket.url()}`);
  });
  page.on('console', (message) => {
    if (message.type() === 'error' && !message.text().includes('WebSocket connection'))
      findings.push(`${view.where}: ${message.text()}`);
  });
  await page.addInitScript(() => {
    document.addEventListener('securitypolicyviolation', (event) => {
      console.error(`policy stops ${event.violatedDirective} ${event.blockedURI}`);
    });
  });
  return view;
}

// The program with the samples of `from`, and what is done on its page. A wait that is in vain is a finding.
// `kept`: the sessions' folder, which stays.
export async function visit(browser, program, from, screen, act, kept) {
  const sessions = kept ?? mkdtempSync(join(tmpdir(), 'flexor-page-'));
  const { live, url } = await start(program, from, sessions);
  const view = await open(browser, url, screen);
  try {
    await act(view, url, sessions);
  } catch (error) {
    view.check(String(error).split('\n').slice(0, 3).join(' '), false);
    await view.picture('failed').catch(() => {}); // of a page that hangs
  }
  view.page.removeAllListeners('console'); // what is loaded at that moment fails
  live.kill('SIGINT');
  await view.at('lost').waitFor();
  await view.page.context().close();
  if (!kept) rmSync(sessions, { recursive: true, force: true });
}

export const step = (view, name) => view.page.locator(`[data-testid=step-${name}][aria-current=step]`).waitFor();
