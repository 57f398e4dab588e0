// Files to keep: the present estimate and the history, as JSON and as CSV.

import * as client from '../api/client';
import type { Estimate, HistoryPoint } from '../api/messages';
import { estimateCsv, historyCsv } from '../text/csv';
import { h } from './dom';

function save(name: string, type: string, text: string): void {
  const address = URL.createObjectURL(new Blob([text], { type }));
  const link = h('a', { href: address, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  // The download has begun by then; the address would keep the text in memory.
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

export type Kind = 'json' | 'estimates' | 'history';

// Saves what the daemon has now. Throws a CallError if it cannot be asked.
export async function download(kind: Kind, id: string, estimate: Estimate | null): Promise<void> {
  const session = `sessions/${id}`;
  if (kind === 'estimates') {
    if (estimate) save(`${id}-estimates.csv`, 'text/csv', estimateCsv(estimate));
    return;
  }
  if (kind === 'history') {
    const points: HistoryPoint[] = await client.getHistory(session);
    const units = new Map((estimate?.parameters ?? []).map(({ name, unit }) => [name, unit]));
    save(`${id}-history.csv`, 'text/csv', historyCsv(points, units));
    return;
  }
  const [about, present, history] = await Promise.all([
    client.getRaw('SessionService/GetSession', { name: session }),
    client.getRaw('SessionService/GetEstimate', { session }),
    client.getRaw('SessionService/GetHistory', { session }),
  ]);
  const all = { session: about, estimate: present, ...(history as object) };
  save(`${id}.json`, 'application/json', `${JSON.stringify(all, null, 1)}\n`);
}
