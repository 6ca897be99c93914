// The report of the demonstration, which demo_test.py has made, in headless Chromium: node demo_browser_test.mjs CHROMIUM DIRECTORY

import assert from "node:assert/strict";
import { statSync } from "node:fs";
import path from "node:path";
import { test } from "node:test";
import { Reader, allDrawn, expectDrawn, figurePoints } from "../../report/test/reader.mjs";

const [executablePath, directory] = process.argv.slice(2);

test("the demonstration's report draws every figure in both themes and asks for nothing", { timeout: 500_000 }, async () => {
  const report = path.resolve(directory, "report.html");
  assert.ok(statSync(report).size < 6e6);
  const reader = await Reader.start(executablePath);
  for (const colorScheme of ["light", "dark"]) {
    await reader.open(report, { colorScheme }, async (page, complaints) => {
      await allDrawn(page);
      const figures = await figurePoints(page);
      expectDrawn(figures);
      for (const name of ["figure-k0", "figure-alignment", "figure-navigation", "figure-open-loops", "figure-innovations", "figure-nis"]) {
        assert.ok(figures.some((figure) => figure.name === name), `no ${name}`);
      }
      assert.match(await page.locator(".verdict .word").textContent(), /Trustworthy/);
      assert.deepEqual(complaints, []);
    });
  }
  await reader.close();
});
