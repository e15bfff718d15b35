// Pictures of the page: `node test/tour.mjs [FOLDER [FRAMES [all]]]`. One run, looked at in several
// sizes and themes; without `all` only those of the README.
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { launch, serve } from "./browser.mjs";

const [folder = fileURLToPath(new URL("../tour", import.meta.url)), frames = "70", all] = process.argv.slice(2);
mkdirSync(folder, { recursive: true });
const server = await serve({ "/": fileURLToPath(new URL("../dist", import.meta.url)) });
const browser = await launch();
const SIZES = { phone: [360, 780], desktop: [1280, 800], wide: [2560, 1440] };
const shots = all
  ? Object.keys(SIZES).flatMap((size) => ["dark", "light"].map((scheme) => ({ name: `${size}-${scheme}`, size, scheme, shading: scheme === "dark" ? "color" : "class" })))
  : [
      { name: "desktop-dark", size: "desktop", scheme: "dark", shading: "color" },
      { name: "wide-light-classes", size: "wide", scheme: "light", shading: "class" },
      { name: "phone-dark", size: "phone", scheme: "dark", shading: "color" },
    ];
const page = await browser.newPage({ viewport: { width: 1280, height: 800 }, colorScheme: "dark" });

async function shoot(name, size, scheme) {
  const [width, height] = SIZES[size];
  await page.setViewportSize({ width, height });
  await page.emulateMedia({ colorScheme: scheme });
  await page.waitForTimeout(500);
  // The view's thread has done all that was asked before it answers.
  await page.evaluate(() => window.mteSlam.view.stats());
  await page.waitForTimeout(1500);
  await page.screenshot({ path: join(folder, `${name}.jpg`), type: "jpeg", quality: 80 });
}

await page.goto(server.url);
await page.waitForFunction(() => window.mteSlam?.ready);
for (const size of all ? Object.keys(SIZES) : ["desktop"])
  for (const scheme of all ? ["dark", "light"] : ["light"]) await shoot(all ? `start-${size}-${scheme}` : `start-${scheme}`, size, scheme);

await page.setViewportSize({ width: 1280, height: 800 });
await page.goto(`${server.url}/?source=room&preset=tiny&engine=cpu&frames=${frames}&width=160&mesh=4&render=7&auto&set.mapping.every=3&set.mapping.rays=900`);
await page.waitForFunction(() => window.mteSlam?.run.finished, null, { timeout: 580_000 });
for (const { name, size, scheme, shading } of shots) {
  await page.setViewportSize({ width: SIZES[size][0], height: SIZES[size][1] });
  await page.locator(`#shading [data-value="${shading}"]`).click();
  if (shading === "class") {
    const box = await page.locator("#view").boundingBox();
    await page.mouse.click(box.x + box.width * 0.5, box.y + box.height * 0.5);
  }
  await shoot(name, size, scheme);
}
if (all) {
  await page.evaluate(() => window.mteSlam.slam.open({ kind: "http", url: `${location.origin}/nowhere` }, { engine: "cpu" }));
  await page.waitForFunction(() => !document.getElementById("failure").hidden);
  await shoot("failure-desktop-light", "desktop", "light");
  await shoot("failure-phone-dark", "phone", "dark");
  await page.reload();
  await page.waitForFunction(() => window.mteSlam?.ready);
  await shoot("go-on-desktop-dark", "desktop", "dark");
}
await browser.close();
server.close();
