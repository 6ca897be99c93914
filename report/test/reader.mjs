// A reader of reports: headless Chromium that opens them and notes what they complain of.

import assert from "node:assert/strict";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const { chromium } = createRequire(new URL("../../package.json", import.meta.url))("playwright-core");

// Without a screen to wait for, headless Chromium now and then stops giving frames, and everything that waits for one
// hangs; less often where it is told not to wait for a screen.
const args = ["--no-sandbox", "--disable-gpu-vsync", "--disable-frame-rate-limit"];
const hangsAfterMs = 60_000;
const attempts = 3;
const hang = Symbol("hang");

export class Reader {
  static async start(executablePath) {
    const reader = new Reader();
    reader.executablePath = executablePath;
    reader.browser = await chromium.launch({ executablePath, args });
    return reader;
  }
  close() { return this.browser.close(); }

  /** What `visit(page, complaints)` returns, of a page with the report open and what it complained of.
   *  Made again in a new browser where one hangs; a visit that fails has failed. */
  async open(file, options, visit) {
    for (let attempt = 0; attempt < attempts; ++attempt) {
      let timer;
      const hung = new Promise((_, reject) => { timer = setTimeout(reject, hangsAfterMs, hang); });
      try {
        return await Promise.race([this.#visit(file, options, visit), hung]);
      } catch (error) {
        if (error !== hang) throw error;
        console.log("the browser hangs");
        await this.browser.close();
        this.browser = await chromium.launch({ executablePath: this.executablePath, args });
      } finally {
        clearTimeout(timer);
      }
    }
    return assert.fail(`the browser hung ${attempts} times`);
  }

  async #visit(file, { width = 1280, height = 900, colorScheme = "light" }, visit) {
    const page = await this.browser.newPage({ viewport: { width, height }, colorScheme });
    page.setDefaultTimeout(0);
    const complaints = [];
    page.on("console", (message) => { if (["error", "warning"].includes(message.type())) complaints.push(message.text()); });
    page.on("pageerror", (error) => complaints.push(String(error)));
    page.on("request", (request) => { if (!/^(file|data|blob):/.test(request.url())) complaints.push(`asked for ${request.url()}`); });
    await page.goto(pathToFileURL(file).href);
    const result = await visit(page, complaints);
    await page.close();
    return result;
  }
}

/** Waits until every figure that is shown is drawn, for which nobody has to scroll. Not by frames, which may not come. */
export const allDrawn = (page) =>
  page.waitForFunction(() => !document.querySelector("figure[data-figure]:not([hidden], [data-drawn])"), null, { polling: 50 });

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
