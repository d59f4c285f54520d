// serve.js FOLDER [PORT]: serves a built page on this machine. Without PORT, on 4173 or the next
// one that is free.
import { preview } from 'vite';

const [outDir, port] = process.argv.slice(2);

process.on('SIGINT', () => process.exit(130));
process.on('SIGTERM', () => process.exit(143));

try {
  const server = await preview({
    logLevel: 'silent',
    build: { outDir },
    preview: { host: '127.0.0.1', port: Number(port ?? 4173), strictPort: port !== undefined },
  });
  const { port: actual } = server.httpServer.address();
  console.log(`The page is at http://localhost:${actual}/ (stop with Ctrl-C).`);
} catch (error) {
  console.error(`upswing: demo: ${error.message}`);
  process.exit(1);
}
