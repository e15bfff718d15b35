// Pictures of the page for the README: `node test/tour.mjs FOLDER`.
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { launch, serve } from "./browser.mjs";

const folder = process.argv[2] ?? fileURLToPath(new URL("../tour", import.meta.url));
mkdirSync(folder, { recursive: true });
const server = await serve({ "/": fileURLToPath(new URL("../dist", import.meta.url)) });
const browser = await launch();
const frames = process.argv[3] ?? "70";
const run = `source=room&preset=tiny&engine=cpu&frames=${frames}&width=160&mesh=4&render=7&auto&set.mapping.every=3&set.mapping.rays=900`;
const shots = [
  { name: "desktop-dark", size: [1280, 800], scheme: "dark", query: run },
  { name: "wide-light-classes", size: [2560, 1440], scheme: "light", query: run, shading: "class" },
  { name: "phone-dark", size: [360, 780], scheme: "dark", query: run },
  { name: "start-light", size: [1280, 800], scheme: "light", query: "" },
];
await Promise.all(shots.map(async ({ name, size: [width, height], scheme, query, shading }) => {
  const page = await browser.newPage({ viewport: { width, height }, colorScheme: scheme });
  await page.goto(`${server.url}/?${query}`);
  await page.waitForFunction(() => window.mteSlam);
  if (query) await page.waitForFunction(() => window.mteSlam.run.finished, null, { timeout: 580_000 });
  if (shading) {
    await page.locator(`#shading [data-value="${shading}"]`).click();
    const box = await page.locator("#view").boundingBox();
    await page.mouse.click(box.x + box.width * 0.5, box.y + box.height * 0.5);
  }
  // The view's thread has done all that was asked before it answers.
  await page.evaluate(() => window.mteSlam.view.stats());
  await page.waitForTimeout(3000);
  await page.screenshot({ path: join(folder, `${name}.jpg`), type: "jpeg", quality: 86 });
}));
await browser.close();
server.close();
