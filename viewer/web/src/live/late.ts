// What is said of a call that has no answer for long.
//
// Enters: what was asked for, as a noun. Leaves: a notice while there is no answer.

import { pass, settle } from '../page/notice.ts';
import { late } from './words.ts';

/** A call that has no answer after so long (ms) is told of. */
const LATE = 1_500;

/** Waits from now on for an answer, which is told with the function that it returns. */
export function answering(doing: string): () => void {
  let isSaid = false;
  const timer = setTimeout(() => {
    isSaid = true;
    pass(late(doing));
  }, LATE);
  return () => {
    clearTimeout(timer);
    if (isSaid) settle();
  };
}
