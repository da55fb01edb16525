// Opens reports in Chromium as a phone and a desktop would, light and dark, and looks for what keeps people from reading
// them: axe-core's serious findings, a page wider than its screen, letters too small, anything fetched from elsewhere.
// Usage: node check_reports.mjs [--pictures FOLDER] REPORT.html...
import { createRequire } from 'node:module';
import { mkdirSync } from 'node:fs';
import { basename, dirname, join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';

const screens = [{ width: 390, height: 844 }, { width: 1280, height: 900 }];
const smallestLetters_px = 9;

// What axe says of the page, most of it in one line each.
async function axeFindings(page) {
  const results = await page.evaluate(() => globalThis.axe.run(document, { resultTypes: ['violations'] }));
  return results.violations
    .filter((v) => v.impact === 'serious' || v.impact === 'critical')
    .map((v) => `${v.impact}: ${v.id}: ${v.help}; ${v.nodes.length} time(s), first ${v.nodes[0].target.join(' ')}`);
}

// What axe does not measure.
async function layoutFindings(page) {
  return page.evaluate((smallest) => {
    const findings = [];
    const root = document.documentElement;
    if (root.scrollWidth > root.clientWidth) findings.push(`page is ${root.scrollWidth} px wide on ${root.clientWidth} px`);
    for (const text of document.querySelectorAll('svg text')) {
      const matrix = text.getScreenCTM();
      const size = parseFloat(getComputedStyle(text).fontSize) * Math.hypot(matrix.a, matrix.b);
      if (text.textContent.trim() !== '' && size < smallest) {
        findings.push(`letters of ${size.toFixed(1)} px in a figure: ${text.textContent.trim().slice(0, 30)}`);
        break;
      }
    }
    return findings;
  }, smallestLetters_px);
}

async function check(browser, file, pictures) {
  const findings = [];
  for (const viewport of screens) {
    for (const colorScheme of ['light', 'dark']) {
      const context = await browser.newContext({ viewport, colorScheme });
      const page = await context.newPage();
      page.on('request', (r) => r.url().startsWith('file:') || r.url().startsWith('data:') || findings.push(`fetches ${r.url()}`));
      await page.goto(pathToFileURL(resolve(file)).href);
      for (const details of await page.$$('details')) await details.evaluate((d) => { d.open = true; });
      await page.addScriptTag({ path: createRequire(import.meta.url).resolve('axe-core') });
      const where = `${viewport.width} px, ${colorScheme}`;
      for (const f of [...await axeFindings(page), ...await layoutFindings(page)]) findings.push(`${where}: ${f}`);
      if (pictures) {
        const name = `${basename(dirname(resolve(file)))}_${viewport.width}_${colorScheme}.png`;
        await page.screenshot({ path: join(pictures, name), fullPage: true });
      }
      await context.close();
    }
  }
  return findings;
}

const files = process.argv.slice(2);
let pictures;
if (files[0] === '--pictures') {
  pictures = files[1];
  mkdirSync(pictures, { recursive: true });
  files.splice(0, 2);
}
if (files.length === 0) {
  console.error('usage: node check_reports.mjs [--pictures FOLDER] REPORT.html...');
  process.exit(2);
}
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', args: ['--no-sandbox'] });
let bad = 0;
for (const file of files) {
  const findings = await check(browser, file, pictures);
  bad += findings.length;
  for (const finding of findings) console.log(`${file}: ${finding}`);
  if (findings.length === 0) console.log(`${file}: nothing serious`);
}
await browser.close();
process.exit(bad > 0 ? 1 : 0);
