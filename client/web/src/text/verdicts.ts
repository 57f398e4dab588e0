// Says in words how well something is known.

import type { Verdict } from '../api/messages';

export interface VerdictWords {
  words: string;
  meaning: string;
  mark: string;  // a sign beside the colour, for those who see no colours
}

const WORDS: Record<Verdict, VerdictWords> = {
  IDENTIFIED: {
    words: 'Determined by the data',
    meaning: 'The data have narrowed the prior at least to a half.',
    mark: '✓',
  },
  WEAK: {
    words: 'Partly determined',
    meaning: 'Both the data and the prior tell something: the prior still counts.',
    mark: '~',
  },
  NOT_IDENTIFIED: {
    words: 'Not determined',
    meaning: 'The data hardly tell anything about it; what is shown is the prior.',
    mark: '?',
  },
  UNKNOWN: { words: 'No verdict', meaning: 'The daemon gave no verdict.', mark: '·' },
};

export const verdictWords = (verdict: Verdict): VerdictWords => WORDS[verdict];
