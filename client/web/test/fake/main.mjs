// Starts a fake daemon to look at: node test/fake/main.mjs [PORT]
import { FakeDaemon } from './fake_daemon.mjs';

const daemon = new FakeDaemon();
const live = daemon.add('monday', { count: 1, hasWriter: true });
daemon.add('empty', { count: 0, hasWriter: true });
for (let k = 0; k < 50; ++k) daemon.add(`run-${String(k).padStart(2, '0')}`, { count: 20 + k, loaded: k % 3 === 0 });
await daemon.start(Number(process.argv[2] ?? 8080));
console.log(`web page on ${daemon.address}`);
setInterval(() => {
  if (live.count % 100 === 30) live.diagnostics = [{ code: 'MODEL_MISFIT', message: 'the residuals of x are 1.4 times the noise' }];
  if (live.count % 100 === 60) live.diagnostics = [];
  live.push();
}, 100);
