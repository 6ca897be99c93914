// Opens the reports of report_samples in headless Chromium, as their readers do:
//   node browser_test.mjs CHROMIUM DIRECTORY
// Fails where a report says something on the console, asks for anything over the network, has a figure without data,
// opens slowly beside the plotting library alone, or is wider than its screen. Screenshots and a printed copy stay beside the reports.

import assert from "node:assert/strict";
import { writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import path from "node:path";
import { test as unlimitedTest, before, after } from "node:test";
import { pathToFileURL } from "node:url";

const { chromium } = createRequire(new URL("../../package.json", import.meta.url))("playwright-core");

const [executablePath, directory] = process.argv.slice(2);
const test = (name, body) => unlimitedTest(name, { timeout: 120_000 }, body);

// Without a screen to wait for, headless Chromium now and then stops giving frames; it does not where it waits for none.
const args = ["--no-sandbox", "--disable-gpu-vsync", "--disable-frame-rate-limit"];

let browser;
before(async () => { browser = await chromium.launch({ executablePath, args }); });
after(() => browser.close());

/** A page with the report open, and what it complained of. */
async function open(name, { width = 1280, height = 900, colorScheme = "light" } = {}) {
  const page = await browser.newPage({ viewport: { width, height }, colorScheme });
  const complaints = [];
  page.on("console", (message) => { if (["error", "warning"].includes(message.type())) complaints.push(message.text()); });
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("request", (request) => { if (!/^(file|data|blob):/.test(request.url())) complaints.push(`asked for ${request.url()}`); });
  const report = pathToFileURL(path.resolve(directory, name)).href;
  await page.goto(report);
  return { page, complaints };
}

/** Scrolls through the report, so that every figure is drawn. False where the browser stopped giving frames. */
const readThrough = (page) => page.evaluate(async () => {
  const frame = () => new Promise((done) => {
    requestAnimationFrame(() => setTimeout(() => done(true), 20));
    setTimeout(() => done(false), 5000);
  });
  for (let y = 0; y < document.body.scrollHeight; y += 300) {
    scrollTo({ top: y, behavior: "instant" });
    if (!(await frame())) return false;
  }
  scrollTo({ top: 0, behavior: "instant" });
  return true;
});

/** A page with the report read through; opened anew where the browser, not the report, stopped. */
async function openAndRead(name, options) {
  for (let attempt = 0; attempt < 3; ++attempt) {
    const opened = await open(name, options);
    if (await readThrough(opened.page)) return opened;
    await opened.page.close();
  }
  return assert.fail("the browser gave no frames, three times");
}

/** Per figure that is shown: its name and the number of points drawn. */
const figurePoints = (page) => page.evaluate(() =>
  [...document.querySelectorAll("figure[data-figure]:not([hidden])")].map((figure) => {
    const tracks = [...figure.querySelectorAll("path.track")].map((track) => track.getAttribute("d").split("L").length);
    const traces = (figure.querySelector(".plot")?.data ?? []).map(({ y, z }) => (z ? z.flat().length : y.filter((v) => v !== null).length));
    return { name: figure.id, points: [...tracks, ...traces].reduce((a, b) => a + b, 0), drawn: figure.dataset.drawn === "true" };
  }));

const overflow = (page) => page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);

for (const name of ["good.html", "troubled.html", "alone.html"]) {
  test(`${name} draws every figure, says nothing on the console and asks for nothing`, async () => {
    const { page, complaints } = await openAndRead(name);
    const figures = await figurePoints(page);
    assert.ok(figures.length >= 8, `only ${figures.length} figures`);
    for (const { name, points, drawn } of figures) {
      assert.ok(drawn, `${name} was not drawn`);
      assert.ok(points > 50, `${name} holds ${points} points`);
    }
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
