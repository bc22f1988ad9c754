/** Jobs: from the socket, and by request where the socket was silent. */
import { signal } from "@preact/signals";
import { callApi } from "../api/client";
import type { Job } from "../api/types";

export const jobs = signal<ReadonlyMap<string, Job>>(new Map());

export function setJob(job: Job): void {
  const known = jobs.peek().get(job.id);
  // An older response must not undo an end; but a resumable job may be running again.
  if (known && ended(known) && !known.resumable && !ended(job)) return;
  jobs.value = new Map(jobs.peek()).set(job.id, job);
}

export function ended(job: Job): boolean {
  return job.state === "succeeded" || job.state === "failed" || job.state === "cancelled";
}

const POLL_MS = 1000;

/** Resolves when the job has ended. Also polls each second: a lost message delays the end but does not hide it. */
export function settled(id: string): Promise<Job> {
  return new Promise(resolve => {
    const done = (job: Job) => {
      clearInterval(timer);
      forget();
      resolve(job);
    };
    const timer = setInterval(() => {
      callApi("GET", "/jobs/{job_id}", { path: { job_id: id } }).then(setJob, () => undefined);
    }, POLL_MS);
    const forget = jobs.subscribe(known => {
      const job = known.get(id);
      // Not during the first call by subscribe: `forget` does not exist yet.
      if (job && ended(job)) queueMicrotask(() => done(job));
    });
  });
}
