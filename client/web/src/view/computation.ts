// Whether the daemon keeps up with the rig, and how well it computes.

import * as client from '../api/client';
import type { DaemonStatus, Estimate, Session } from '../api/messages';
import { PacedJob } from '../state/paced_job';
import { bytes, duration, significant, times, whole } from '../text/number';
import { TERMS } from '../text/terms';
import { type View, card } from './dom';
import { type Fact, facts } from './facts';

const INTERVAL_MS = 5_000;

// Batches that wait where an estimator keeps up, and where it clearly does not.
const MANY_BATCHES = 8;

function realTime({ activity }: Session): Fact {
  const factor = activity.realTimeFactor;
  const fact = { label: 'Speed', explanation: TERMS.realTime };
  if (!(factor > 0)) return { ...fact, text: '–' };
  const text = factor >= 1 ? `${times(factor)} × real time` : `${significant(factor, 2)} × real time: too slow`;
  return { ...fact, text, tone: factor >= 1 ? 'good' : 'bad' };
}

function unprocessed({ activity }: Session): Fact {
  const count = activity.unprocessedBatchCount;
  return {
    label: 'Batches waiting', explanation: TERMS.unprocessed, text: whole(count),
    tone: count >= MANY_BATCHES ? 'bad' : 'good',
  };
}

export class ComputationView implements View {
  readonly element: HTMLElement;
  private readonly load = facts();
  private readonly daemon = facts();
  private readonly job: PacedJob;
  private status: DaemonStatus | null = null;

  constructor() {
    this.job = new PacedJob(INTERVAL_MS, async (stop) => {
      try {
        this.status = await client.getStatus(stop);
      } catch {
        // The session's stream says what is wrong.
      }
      this.showStatus();
    });
    this.element = card('Computation', this.load.element, this.daemon.element);
    this.element.classList.add('computation');
  }

  update(session: Session | null, estimate: Estimate | null): void {
    this.job.request();
    const entries: Fact[] = [];
    if (session) {
      entries.push(
        realTime(session), unprocessed(session),
        { label: 'Batches', explanation: '', text: whole(session.lastSequence) },
        { label: 'Rig', explanation: '', text: session.activity.hasWriter ? 'connected' : 'not connected' });
    }
    if (estimate) {
      const { expansion } = estimate;
      entries.push(
        { label: 'Computation error', explanation: TERMS.residualToNoise, text: `${significant(expansion.residualToNoise, 2)} of noise` },
        { label: 'Re-expansions', explanation: TERMS.reexpansion, text: whole(expansion.reexpansions) },
        { label: 'Order', explanation: TERMS.order, text: `${whole(expansion.order)}, ${whole(expansion.points)} points` });
    }
    this.load.set(entries);
  }

  // The daemon's version; empty while it is not known.
  get version(): string {
    return this.status?.version ?? '';
  }

  dispose(): void {
    this.job.dispose();
  }

  private showStatus(): void {
    const { status } = this;
    if (!status) return;
    this.daemon.set([
      { label: 'Daemon', explanation: '', text: `polyestd ${status.version}` },
      { label: 'Up for', explanation: '', text: duration(status.uptimeS) },
      { label: 'Memory', explanation: '', text: bytes(status.memoryBytes) },
      { label: 'Survives a restart', explanation: TERMS.durable, text: status.durable ? 'yes' : 'no' },
    ]);
  }
}
