/** Requests that take many servos at once: everything that is wanted goes in one, and the next after its answer. */

/** So long between two requests: servos that are found or start again one after another share them. */
export const PAUSE_MS = 500;

/** Collects servos and hands all of them to `act`; those wanted meanwhile wait for its answer and the pause. */
export function batched(act: (uids: readonly string[]) => Promise<void>): (uid: string) => void {
  const waiting = new Set<string>();
  let busy = false;
  const turn = async () => {
    const uids = [...waiting];
    waiting.clear();
    busy = uids.length > 0;
    if (!busy) return;
    try {
      await act(uids);
    } finally {
      setTimeout(() => void turn(), PAUSE_MS);
    }
  };
  return uid => {
    waiting.add(uid);
    if (busy) return;
    busy = true;
    setTimeout(() => void turn());
  };
}
