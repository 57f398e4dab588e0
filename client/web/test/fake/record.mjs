// Records what a daemon answers about a session, for the fake daemon:
//
//   node test/fake/record.mjs http://127.0.0.1:8080 monday > test/fake/recording.json
//
// Numbers keep seven digits.
const [origin, id] = process.argv.slice(2);
const session = `sessions/${id}`;
const subject = { session };

async function call(path, body) {
  const answer = await fetch(`${origin}/v1/${path}`, {
    method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body),
  });
  if (!answer.ok) throw new Error(`${path}: ${answer.status} ${await answer.text()}`);
  return answer.json();
}

const recording = {
  session: await call('SessionService/GetSession', { name: session }),
  history: await call('SessionService/GetHistory', { session }),
  estimate: await call('SessionService/GetEstimate', { session }),
  prediction: await call('StudyService/Predict', { subject, drawCount: 50, maxRowCount: '400' }),
  posterior: await call('StudyService/ComputePosterior', { subject, allJoints: true, jointBinCount: 32, densityBinCount: 64 }),
  status: await call('StatusService/GetStatus', {}),
};
const round = (_key, value) => (typeof value === 'number' ? Number(value.toPrecision(7)) : value);
process.stdout.write(`${JSON.stringify(recording, round)}\n`);
