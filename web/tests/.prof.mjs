import { ready, serve, visit } from './visit.mjs';
const server = await serve();
await visit({}, async (page) => {
  await page.goto(`${server.address}#everything`);
  await ready(page);
  await page.click('#agent-on');
  await page.selectOption('#twin', 'd3qn-randomized');
  await page.evaluate(() => document.getElementById('map').scrollIntoView({ block: 'end' }));
  await page.waitForTimeout(2000);
  const b = page.context().browser();
  await b.startTracing(page, {
    categories: [
      'devtools.timeline',
      'disabled-by-default-v8.cpu_profiler',
      'toplevel',
      'cc',
      'viz',
    ],
  });
  await page.waitForTimeout(6000);
  const buf = await b.stopTracing();
  const ev = JSON.parse(buf.toString()).traceEvents;
  const names = {};
  for (const e of ev) if (e.name === 'thread_name') names[e.pid + ':' + e.tid] = e.args.name;
  const tot = {};
  for (const e of ev)
    if (e.ph === 'X' && e.dur) {
      const k = (names[e.pid + ':' + e.tid] || '?') + ' | ' + e.name;
      tot[k] ??= [0, 0];
      tot[k][0] += e.dur / 1000;
      tot[k][1]++;
    }
  console.log(
    Object.entries(tot)
      .sort((a, b) => b[1][0] - a[1][0])
      .slice(0, 38)
      .map(([k, [t, n]]) => `${t.toFixed(0).padStart(7)} ms ${String(n).padStart(6)}  ${k}`)
      .join('\n'),
  );
  // cpu profile
  const self = {};
  const nodes = new Map();
  for (const e of ev)
    if (e.name === 'ProfileChunk') {
      const d = e.args.data;
      for (const n of d.cpuProfile?.nodes ?? []) nodes.set(e.id + ':' + n.id, n);
      const s = d.cpuProfile?.samples ?? [];
      const dt = d.timeDeltas ?? [];
      s.forEach((id, i) => {
        const n = nodes.get(e.id + ':' + id);
        if (!n) return;
        const k = `${n.callFrame.functionName} ${(n.callFrame.url || '').split('/').pop()}:${n.callFrame.lineNumber}:${n.callFrame.columnNumber}`;
        self[k] = (self[k] || 0) + (dt[i] || 0) / 1000;
      });
    }
  console.log(
    Object.entries(self)
      .sort((a, b) => b[1] - a[1])
      .slice(0, 28)
      .map(([k, t]) => `${t.toFixed(0).padStart(7)} ms ${k}`)
      .join('\n'),
  );
});
await server.close();
