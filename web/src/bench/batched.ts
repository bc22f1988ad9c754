/** Requests batched over servos: one request for all, the next after its response. */

/** Pause between two requests, so that servos that appear in turn share them. */
export const PAUSE_MS = 500;

/** Collects servos and passes all of them to `act`; further servos wait for its response and the pause. */
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
