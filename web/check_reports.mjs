// Opens reports in Chromium as a phone and a desktop would, light and dark, and looks for what keeps people from reading
// them: axe-core's serious findings, a page wider than its screen, letters too small, anything fetched from elsewhere.
// Usage: node check_reports.mjs [--pictures FOLDER] REPORT.html...
import { basename, dirname, join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { findings, finish, launch, option, seriousFindings, watch } from './live/browser_test.mjs';

const screens = [{ width: 390, height: 844 }, { width: 1280, height: 900 }];
const smallestLetters_px = 9;

// What axe does not measure.
async function layoutFindings(page) {
  return page.evaluate((smallest) => {
    const found = [];
    const root = document.documentElement;
    if (root.scrollWidth > root.clientWidth) found.push(`page is ${root.scrollWidth} px wide on ${root.clientWidth} px`);
    for (const text of document.querySelectorAll('svg text')) {
      const matrix = text.getScreenCTM();
      const size = parseFloat(getComputedStyle(text).fontSize) * Math.hypot(matrix.a, matrix.b);
      if (text.textContent.trim() !== '' && size < smallest) {
        found.push(`letters of ${size.toFixed(1)} px in a figure: ${text.textContent.trim().slice(0, 30)}`);
        break;
      }
    }
    return found;
  }, smallestLetters_px);
}

async function look(browser, file, viewport, colorScheme, pictures) {
  const context = await browser.newContext({ viewport, colorScheme });
  context.setDefaultTimeout(300e3);
  const page = await context.newPage();
  const where = `${file}: ${viewport.width} px, ${colorScheme}`;
  watch(page, 'file:', where);
  await page.goto(pathToFileURL(resolve(file)).href);
  for (const details of await page.$$('details')) await details.evaluate((d) => { d.open = true; });
  for (const found of [...await seriousFindings(page), ...await layoutFindings(page)]) findings.push(`${where}: ${found}`);
  const name = `${basename(dirname(resolve(file)))}_${viewport.width}_${colorScheme}.png`;
  if (pictures) await page.screenshot({ path: join(pictures, name), fullPage: true });
  await context.close();
}

const files = process.argv.slice(2);
const pictures = option('--pictures');
if (pictures) files.splice(0, 2);
if (files.length === 0) {
  console.error('usage: node check_reports.mjs [--pictures FOLDER] REPORT.html...');
  process.exit(2);
}
const browser = await launch();
for (const file of files) {
  for (const viewport of screens) for (const colorScheme of ['light', 'dark']) await look(browser, file, viewport, colorScheme, pictures);
}
await browser.close();
finish();
