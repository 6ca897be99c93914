// Opens the reports of report_samples in headless Chromium, as their readers do:
//   node browser_test.mjs CHROMIUM DIRECTORY
// Fails where a report says something on the console, asks for anything over the network, has a figure without data,
// opens slowly beside the plotting library alone, or is wider than its screen. Screenshots and a printed copy stay beside the reports.

import assert from "node:assert/strict";
import { writeFile } from "node:fs/promises";
import path from "node:path";
import { test as unlimitedTest, before, after } from "node:test";
import { Reader, expectDrawn, figurePoints, readThrough } from "./reader.mjs";

const [executablePath, directory] = process.argv.slice(2);
const test = (name, body) => unlimitedTest(name, { timeout: 120_000 }, body);

let reader;
before(async () => { reader = await Reader.start(executablePath); });
after(() => reader.close());
const open = (name, options) => reader.open(path.resolve(directory, name), options);
const openAndRead = (name, options) => reader.openAndRead(path.resolve(directory, name), options);

const overflow = (page) => page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);

for (const name of ["good.html", "troubled.html", "alone.html"]) {
  test(`${name} draws every figure, says nothing on the console and asks for nothing`, async () => {
    const { page, complaints } = await openAndRead(name);
    expectDrawn(await figurePoints(page));
    assert.deepEqual(complaints, []);
    await page.close();
  });
}

test("nine hours open in a small multiple of what the plotting library alone takes", async () => {
  // The least of three: whatever else the machine does only adds.
  const leastOpeningOf = async (name) => {
    let least = Infinity;
    for (let i = 0; i < 3; ++i) {
      const { page } = await open(name);
      least = Math.min(least, await page.evaluate(() => performance.getEntriesByName("report-ready")[0].startTime));
      await page.close();
    }
    return least;
  };
  const { page } = await open("good.html");
  const library = await page.evaluate(() =>
    [...document.scripts].map(({ textContent }) => textContent).reduce((longest, text) => (text.length > longest.length ? text : longest)));
  await page.close();
  await writeFile(path.join(directory, "library.html"),
    `<!doctype html><link rel="icon" href="data:,"><script>${library}</script><script>performance.mark("report-ready")</script>`);
  const [report, alone] = [await leastOpeningOf("good.html"), await leastOpeningOf("library.html")];
  console.log(`open after ${report.toFixed(0)} ms, the library alone after ${alone.toFixed(0)} ms`);
  assert.ok(report < 20 * alone);
});

for (const colorScheme of ["light", "dark"]) {
  test(`the theme is ${colorScheme} where the reader's is, until he chooses the other`, async () => {
    const { page, complaints } = await openAndRead("troubled.html", { colorScheme });
    const theme = () => page.evaluate(() => document.documentElement.dataset.theme);
    assert.equal(await theme(), colorScheme);
    await page.screenshot({ path: path.join(directory, `${colorScheme}.png`), fullPage: true });
    await page.click("#theme");
    assert.notEqual(await theme(), colorScheme);
    assert.deepEqual(complaints, []);
    await page.close();
  });
}

for (const width of [360, 768, 1920]) {
  test(`fits a screen of ${width} pixels`, async () => {
    const { page, complaints } = await openAndRead("troubled.html", { width });
    assert.ok((await overflow(page)) <= 0, `wider by ${await overflow(page)} pixels`);
    await page.screenshot({ path: path.join(directory, `width-${width}.png`), fullPage: true });
    assert.deepEqual(complaints, []);
    await page.close();
  });
}

test("shows any coefficient, and enlarged", async () => {
  const { page, complaints } = await open("good.html");
  await page.click("#all-coefficients");
  await page.check('input[name="view"][value="detail"]');
  assert.ok(await readThrough(page));
  const coefficients = (await figurePoints(page)).filter(({ name }) => /k0|mu|nu/.test(name));
  assert.equal(coefficients.length, 7);
  await page.locator("#coefficients").screenshot({ path: path.join(directory, "coefficients-enlarged.png") });
  await page.uncheck('input[name="coefficient"][value="k0"]');
  assert.ok(await page.locator("#figure-k0").isHidden());
  assert.deepEqual(complaints, []);
  await page.close();
});

test("a sphere turns with the keyboard", async () => {
  const { page } = await openAndRead("good.html");
  const track = () => page.locator(".sphere path.track").first().getAttribute("d");
  const start = await track();
  await page.locator(".sphere svg").first().focus();
  await page.keyboard.press("ArrowRight");
  assert.notEqual(await track(), start);
  await page.close();
});

test("a hostile name of a spacecraft is only text", async () => {
  const { page } = await open("alone.html");
  assert.match(await page.locator("h1").textContent(), /<\/script><script>throw/);
  await page.close();
});

test("prints every figure on white, also from the dark theme, and goes back to it", async () => {
  const { page, complaints } = await open("troubled.html", { colorScheme: "dark" });
  await page.pdf({ path: path.join(directory, "print.pdf"), preferCSSPageSize: true, printBackground: true });
  assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), "dark");
  assert.equal(await page.evaluate(() => document.querySelectorAll("figure[data-figure]:not([data-drawn])").length), 0);
  assert.deepEqual(complaints, []);
  await page.close();
});
