// npm run pictures: pictures of the page for docs/ and the README.
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { ready, serve, visit } from './visit.mjs';

const server = await serve();
const docs = fileURLToPath(new URL('../../docs/figures/', import.meta.url));

/// Stops time without the look of a paused page.
async function stop() {
  upswing.clock.speed = 0;
  await new Promise((resolve) => setTimeout(resolve, 500));
}

/// The tour's first step: the agent swings up from hanging, stopped on the way.
async function swingUp(page) {
  await page.goto(`${server.address}#tour=1`);
  await ready(page);
  await page.waitForFunction(() => {
    const { q1, q2 } = upswing.world.state;
    return Math.cos(q1) < 0.1 && Math.cos(q1 + q2) < -0.3;
  });
  await page.evaluate(stop);
}

await visit({ viewport: { width: 1400, height: 860 } }, async (page) => {
  await swingUp(page);
  await page.screenshot({ path: `${docs}page.png` });
});
console.log('docs/figures/page.png');

/// Makes a film. record(folder) writes the pictures and returns ffmpeg's input arguments.
async function film(name, width, colors, record) {
  const folder = mkdtempSync(join(tmpdir(), 'upswing-film-'));
  const pictures = await record(folder);
  const palette =
    `scale=${width}:-1:flags=lanczos,split[a][b];[a]palettegen=max_colors=${colors}[p];` +
    '[b][p]paletteuse=dither=none';
  const made = ['-vf', palette, '-fps_mode', 'passthrough', `${docs}${name}`];
  execFileSync('ffmpeg', ['-y', '-v', 'error', ...pictures, ...made]);
  rmSync(folder, { recursive: true });
  console.log(`docs/figures/${name}`);
}

/// Some of the shown frames as seconds of a film: from `begin` to `end` (s), `speed` times as fast as
/// they were, `rate` a second of the film.
function chosen(frames, begin, end, speed, rate) {
  const picked = [];
  const step = speed / rate;
  for (let at = begin; at < end; at += step) {
    const data = frames.findLast((frame) => frame.at <= at)?.data ?? frames[0].data;
    picked.push({ data, seconds: 1 / rate });
  }
  return picked;
}

/// The README's film: an agent learns. The training is shown in LEARNING s, and then the agent swings
/// up at its own speed.
const LEARNING = 11;
const BALANCED = 2; // s

async function learning(page, folder) {
  await page.goto(`${server.address}#tour=3`);
  await ready(page);
  const devtools = await page.context().newCDPSession(page);
  const frames = [];
  devtools.on('Page.screencastFrame', ({ data, metadata, sessionId }) => {
    frames.push({ at: metadata.timestamp, data });
    void devtools.send('Page.screencastFrameAck', { sessionId });
  });
  const learn = page.locator('#tour-learn');
  await learn.click();
  await devtools.send('Page.startScreencast', { format: 'png' });
  await learn.filter({ hasText: 'Start over' }).waitFor({ timeout: 0 });
  const learned = Date.now() / 1000;
  await page.evaluate(() => upswing.world.reset());
  await page.waitForFunction((least) => upswing.world.uprightFor > least, BALANCED, { timeout: 0 });
  await devtools.send('Page.stopScreencast');
  devtools.removeAllListeners('Page.screencastFrame');
  const begin = frames[0].at;
  const pictures = [
    ...chosen(frames, begin, learned, (learned - begin) / LEARNING, 5),
    ...chosen(frames, learned, frames.at(-1).at, 1, 12),
  ];
  const list = pictures.map(({ data, seconds }, i) => {
    const name = `${String(i).padStart(3, '0')}.png`;
    writeFileSync(join(folder, name), Buffer.from(data, 'base64'));
    return `file '${name}'\nduration ${seconds}\n`;
  });
  writeFileSync(join(folder, 'list.txt'), list.join(''));
  return ['-f', 'concat', '-i', join(folder, 'list.txt')];
}

await visit({ viewport: { width: 1000, height: 620 }, colorScheme: 'dark' }, (page) =>
  film('learning.gif', 480, 40, (folder) => learning(page, folder)),
);

/// The documentation's film: the agent swings up, is shoved twice, and recovers. 25 frames a second.
async function recovery(page, folder) {
  await page.goto(`${server.address}#tour=4`);
  await ready(page);
  await page.evaluate(stop);
  await page.evaluate(() => {
    for (const found of document.querySelectorAll('header, #badge')) found.style.opacity = '0';
  });
  for (let frame = 0; frame < 220; ++frame) {
    await page.evaluate(async (frame) => {
      if (frame === 85) upswing.world.shoveTo(1);
      if (frame === 145) upswing.world.shoveTo(-1);
      for (let k = 0; k < 8; ++k) upswing.world.advance(); // 5 ms each
      upswing.clock.settle();
      await new Promise(requestAnimationFrame);
      await new Promise(requestAnimationFrame);
    }, frame);
    const clip = { x: 32, y: 16, width: 728, height: 728 }; // the stage without the words
    await page.screenshot({ path: join(folder, `${String(frame).padStart(3, '0')}.png`), clip });
  }
  return ['-framerate', '25', '-i', join(folder, '%03d.png')];
}

await visit({ viewport: { width: 1200, height: 760 }, colorScheme: 'dark' }, (page) =>
  film('recovery.gif', 420, 160, (folder) => recovery(page, folder)),
);
await server.close();
