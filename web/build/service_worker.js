// Keeps the page for visits without a network. build/offline.ts puts its VERSION, FILES and AGENTS here.
const CACHE = `upswing-${VERSION}`;

self.addEventListener('install', (event) => {
  const fill = async () => {
    const cache = await caches.open(CACHE);
    await cache.addAll(FILES);
    await Promise.allSettled(AGENTS.map((agent) => cache.add(agent)));
    await self.skipWaiting();
  };
  event.waitUntil(fill());
});

self.addEventListener('activate', (event) => {
  const clean = async () => {
    const old = (await caches.keys()).filter(
      (name) => name.startsWith('upswing-') && name !== CACHE,
    );
    await Promise.all(old.map((name) => caches.delete(name)));
    await self.clients.claim();
  };
  event.waitUntil(clean());
});

// Assets have their hash in their name. All others come from the network while there is one, so that
// no page is older than its server's.
self.addEventListener('fetch', (event) => {
  const { request } = event;
  const { origin, pathname, href } = new URL(request.url);
  if (request.method !== 'GET' || origin !== location.origin) return;
  if (!href.startsWith(self.registration.scope)) return;
  const answer = async () => {
    const cache = await caches.open(CACHE);
    const ignoreSearch = request.mode === 'navigate';
    const kept = await cache.match(request, { ignoreSearch, ignoreVary: true });
    if (kept && pathname.includes('/assets/')) return kept;
    try {
      const response = await fetch(request);
      if (response.ok) await cache.put(request, response.clone());
      return response;
    } catch (error) {
      if (kept) return kept;
      throw error;
    }
  };
  event.respondWith(answer());
});
