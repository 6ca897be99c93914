// A reader of reports: headless Chromium that scrolls through them and notes what they complain of.

import assert from "node:assert/strict";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const { chromium } = createRequire(new URL("../../package.json", import.meta.url))("playwright-core");

// Without a screen to wait for, headless Chromium now and then stops giving frames; it does not where it waits for none.
const args = ["--no-sandbox", "--disable-gpu-vsync", "--disable-frame-rate-limit"];

export class Reader {
  static async start(executablePath) {
    const reader = new Reader();
    reader.browser = await chromium.launch({ executablePath, args });
    return reader;
  }
  close() { return this.browser.close(); }

  /** A page with the report open, and what it complained of. */
  async open(file, { width = 1280, height = 900, colorScheme = "light" } = {}) {
    const page = await this.browser.newPage({ viewport: { width, height }, colorScheme });
    const complaints = [];
    page.on("console", (message) => { if (["error", "warning"].includes(message.type())) complaints.push(message.text()); });
    page.on("pageerror", (error) => complaints.push(String(error)));
    page.on("request", (request) => { if (!/^(file|data|blob):/.test(request.url())) complaints.push(`asked for ${request.url()}`); });
    await page.goto(pathToFileURL(file).href);
    return { page, complaints };
  }

  /** A page with the report read through; opened anew where the browser, not the report, stopped. */
  async openAndRead(file, options) {
    for (let attempt = 0; attempt < 3; ++attempt) {
      const opened = await this.open(file, options);
      if (await readThrough(opened.page)) return opened;
      await opened.page.close();
    }
    return assert.fail("the browser gave no frames, three times");
  }
}

/** Scrolls through the report, so that every figure is drawn. False where the browser stopped giving frames. */
export const readThrough = (page) => page.evaluate(async () => {
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

/** Per figure that is shown: its name and the number of points drawn. */
export const figurePoints = (page) => page.evaluate(() =>
  [...document.querySelectorAll("figure[data-figure]:not([hidden])")].map((figure) => {
    const tracks = [...figure.querySelectorAll("path.track")].map((track) => track.getAttribute("d").split("L").length);
    const traces = (figure.querySelector(".plot")?.data ?? []).map(({ y, z }) => (z ? z.flat().length : y.filter((v) => v !== null).length));
    return { name: figure.id, points: [...tracks, ...traces].reduce((a, b) => a + b, 0), drawn: figure.dataset.drawn === "true" };
  }));

export function expectDrawn(figures) {
  assert.ok(figures.length >= 8, `only ${figures.length} figures`);
  for (const { name, points, drawn } of figures) {
    assert.ok(drawn, `${name} was not drawn`);
    assert.ok(points > 50, `${name} holds ${points} points`);
  }
}
