import { ready, serve, visit } from './visit.mjs';
const server = await serve();
const variants = (process.argv[2] ?? 'base').split('|');
for (const css of variants)
  await visit({}, async (page) => {
    await page.goto(`${server.address}#everything`);
    await ready(page);
    await page.click('#agent-on');
    if (!css.includes('notwin')) await page.selectOption('#twin', 'd3qn-randomized');
    if (css.startsWith('#'))
      await page.evaluate((s) => {
        for (const el of document.querySelectorAll(s))
          el.style.setProperty('display', 'none', 'important');
      }, css);
    await page.evaluate(() => document.getElementById('map').scrollIntoView({ block: 'end' }));
    await page.waitForTimeout(2500);
    const b = page.context().browser();
    await b.startTracing(page, { categories: ['devtools.timeline', 'toplevel', 'cc'] });
    await page.waitForTimeout(4000);
    const ev = JSON.parse((await b.stopTracing()).toString()).traceEvents;
    const d = (n) => {
      const l = ev
        .filter((e) => e.ph === 'X' && e.name === n && e.tdur !== undefined)
        .map((e) => e.tdur / 1000)
        .sort((a, b) => a - b);
      return `${n} n=${l.length} mean ${(l.reduce((s, x) => s + x, 0) / l.length).toFixed(2)} p50 ${l[l.length >> 1]?.toFixed(2)} p90 ${l[Math.floor(l.length * 0.9)]?.toFixed(2)}`;
    };
    console.log(
      css.padEnd(34),
      d('ProxyMain::BeginMainFrame'),
      '|',
      d('FireAnimationFrame'),
      '|',
      d('LayerTreeHost::DoUpdateLayers'),
    );
  });
await server.close();
