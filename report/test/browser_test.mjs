// Opens the reports of report_samples in headless Chromium, as their readers do:
//   node browser_test.mjs CHROMIUM DIRECTORY
// Fails where a report says something on the console, asks for anything over the network, has a figure without data,
// opens slowly beside the plotting library alone, or is wider than its screen. Printed copies stay beside the reports. No screenshot of a whole
// page is taken: on a busy machine, headless Chromium needs half a minute for one, or hangs.

import assert from "node:assert/strict";
import { writeFile } from "node:fs/promises";
import path from "node:path";
import { test as unlimitedTest, before, after } from "node:test";
import { Reader, allDrawn, expectDrawn, figurePoints } from "./reader.mjs";

const [executablePath, directory] = process.argv.slice(2);
const test = (name, body) => unlimitedTest(name, { timeout: 300_000 }, body);

let reader;
before(async () => { reader = await Reader.start(executablePath); });
after(() => reader.close());
const open = (name, options, visit) => reader.open(path.resolve(directory, name), options, visit);
const openAndDraw = (name, options, visit) => open(name, options, async (page, complaints) => {
  await allDrawn(page);
  await visit(page, complaints);
});

const overflow = (page) => page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);

for (const name of ["good.html", "troubled.html", "alone.html"]) {
  test(`${name} draws every figure, says nothing on the console and asks for nothing`, () =>
    openAndDraw(name, {}, async (page, complaints) => {
      expectDrawn(await figurePoints(page));
      assert.deepEqual(complaints, []);
    }));
}

test("a history draws each parameter of each gyro, on a screen and on paper", () =>
  openAndDraw("history.html", { width: 768 }, async (page, complaints) => {
    const points = await page.evaluate(() => [...document.querySelectorAll('figure[data-figure="trend"] .plot')].map(({ data }) =>
      data.flatMap(({ y }) => y).filter((v) => v !== null).length));
    assert.deepEqual(points, [...Array(7).fill(18), 1, ...Array(3).fill(18)]);
    assert.ok((await overflow(page)) <= 0, `wider by ${await overflow(page)} pixels`);
    await page.pdf({ path: path.join(directory, "history.pdf"), preferCSSPageSize: true, printBackground: true });
    assert.deepEqual(complaints, []);
  }));

test("a campaign draws each figure, on a screen and on paper", () =>
  openAndDraw("campaign.html", { width: 768 }, async (page, complaints) => {
    const figures = await figurePoints(page);
    assert.ok(figures.length > 13, `only ${figures.length} figures`);
    for (const { name, points } of figures) assert.ok(points >= 30, `${name} holds ${points} points`);
    assert.ok((await overflow(page)) <= 0, `wider by ${await overflow(page)} pixels`);
    await page.pdf({ path: path.join(directory, "campaign.pdf"), preferCSSPageSize: true, printBackground: true });
    assert.deepEqual(complaints, []);
  }));

test("what matters in a campaign stays legible on a screen of 400 pixels, and scrolls", () =>
  openAndDraw("campaign.html", { width: 400 }, async (page) => {
    assert.ok((await overflow(page)) <= 0, `wider by ${await overflow(page)} pixels`);
    const [shown, drawn, columns] = await page.evaluate(() => {
      const plot = document.querySelector('figure[data-figure="influences"] .plot');
      return [plot.clientWidth, plot.scrollWidth, plot.data[0].x.length];
    });
    assert.ok(drawn > shown && drawn > 22 * columns, `${drawn} pixels in ${shown} for ${columns} columns`);
  }));

test("what a window shows is drawn before the page has loaded", () =>
  open("campaign.html", { height: 8000 }, async (page) => {
    const blank = await page.evaluate(() => [...document.querySelectorAll("figure")].filter((figure) =>
      !figure.dataset.drawn && figure.getBoundingClientRect().top < innerHeight).length);
    assert.equal(blank, 0);
  }));

test("nine hours open in a small multiple of what the plotting library alone takes", async () => {
  // The least of three: whatever else the machine does only adds.
  const leastOpeningOf = async (name) => {
    let least = Infinity;
    for (let i = 0; i < 3; ++i) {
      const opening = await open(name, {}, (page) => page.evaluate(() => performance.getEntriesByName("report-ready")[0].startTime));
      least = Math.min(least, opening);
    }
    return least;
  };
  const library = await open("good.html", {}, (page) => page.evaluate(() =>
    [...document.scripts].map(({ textContent }) => textContent).reduce((longest, text) => (text.length > longest.length ? text : longest))));
  await writeFile(path.join(directory, "library.html"),
    `<!doctype html><link rel="icon" href="data:,"><script>${library}</script><script>performance.mark("report-ready")</script>`);
  const [report, alone] = [await leastOpeningOf("good.html"), await leastOpeningOf("library.html")];
  console.log(`open after ${report.toFixed(0)} ms, the library alone after ${alone.toFixed(0)} ms`);
  assert.ok(report < 20 * alone);
});

for (const colorScheme of ["light", "dark"]) {
  test(`the theme is ${colorScheme} where the reader's is, until he chooses the other`, () =>
    open("troubled.html", { colorScheme }, async (page, complaints) => {
      const theme = () => page.evaluate(() => document.documentElement.dataset.theme);
      assert.equal(await theme(), colorScheme);
      await page.click("#theme");
      assert.notEqual(await theme(), colorScheme);
      assert.deepEqual(complaints, []);
    }));
}

for (const [width, colorScheme] of [[360, "light"], [768, "dark"], [1920, "light"]]) {
  test(`fits a screen of ${width} pixels`, () =>
    openAndDraw("troubled.html", { width, colorScheme }, async (page, complaints) => {
      assert.ok((await overflow(page)) <= 0, `wider by ${await overflow(page)} pixels`);
      assert.deepEqual(complaints, []);
    }));
}

test("shows any coefficient, and enlarged", () =>
  open("good.html", {}, async (page, complaints) => {
    await page.click("#all-coefficients");
    await page.check('input[name="view"][value="detail"]');
    await allDrawn(page);
    const coefficients = (await figurePoints(page)).filter(({ name }) => /k0|mu|nu/.test(name));
    assert.equal(coefficients.length, 7);
    await page.locator("#coefficients").screenshot({ path: path.join(directory, "coefficients-enlarged.png") });
    await page.uncheck('input[name="coefficient"][value="k0"]');
    assert.ok(await page.locator("#figure-k0").isHidden());
    assert.deepEqual(complaints, []);
  }));

test("a sphere turns with the keyboard", () =>
  openAndDraw("good.html", {}, async (page) => {
    const track = () => page.locator(".sphere path.track").first().getAttribute("d");
    const start = await track();
    await page.locator(".sphere svg").first().focus();
    await page.keyboard.press("ArrowRight");
    assert.notEqual(await track(), start);
  }));

test("a hostile name of a spacecraft is only text", () =>
  open("alone.html", {}, async (page) => {
    assert.match(await page.locator("h1").textContent(), /<\/script><script>throw/);
  }));

test("prints every figure on white, also from the dark theme, and goes back to it", () =>
  open("troubled.html", { colorScheme: "dark" }, async (page, complaints) => {
    await page.pdf({ path: path.join(directory, "print.pdf"), preferCSSPageSize: true, printBackground: true });
    assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), "dark");
    assert.equal(await page.evaluate(() => document.querySelectorAll("figure[data-figure]:not([data-drawn])").length), 0);
    assert.deepEqual(complaints, []);
  }));
