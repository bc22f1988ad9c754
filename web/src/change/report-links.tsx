/** Links to the report of a job: files, and a page to print. */
import { API } from "../api/client";
import { Icon } from "../kit/icon";
import { changing } from "./words";

const strings = changing.report;

export function ReportLinks({ job, title }: { job: string; title: string }) {
  const path = `${API}/jobs/${job}/report?format=`;
  return (
    <div class="report-links" role="group" aria-label={title}>
      <span class="second">{title}</span>
      {(["csv", "json", "junit"] as const).map(form => (
        <a key={form} class="button" href={path + form} download="" data-testid={`report-${form}`}>
          <Icon name="download" size={15} /> {strings[form]}
        </a>
      ))}
      <a class="button" href={`${path}html`} target="_blank" rel="noreferrer" data-testid="report-html">
        {strings.html}
      </a>
    </div>
  );
}
