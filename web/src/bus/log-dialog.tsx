/** The log dialog: format, name and size limit, progress, and stored files. */

import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { LogFile, LogFormat, LogState } from "../api/bus-types";
import { connected } from "../bench/bench";
import { clock, date, grouped, minute, size } from "../bench/format";
import { noteText } from "../bench/note-text";
import { parseNumber } from "../bench/number";
import { Button } from "../kit/button";
import { Dialog } from "../kit/dialog";
import { TextField } from "../kit/field";
import { Glyph } from "../kit/glyph";
import { Icon } from "../kit/icon";
import { Note } from "../kit/note";
import { Segments } from "../kit/segments";
import { listLogs, log, logProblem, logs, removeLog, startLog, stopLog, urlOf } from "./log";
import { busWords as words } from "./words";

const strings = words.logDialog;
const FORMATS: readonly LogFormat[] = ["candump", "asc", "blf", "csv"];
const MOST_MB = 10_000;
const USUAL_MB = 100;

export function LogDialog({ onClose }: { onClose: () => void }) {
  const state = log.value?.state;
  // The list is read again when a log starts or ends, also by another client.
  useEffect(() => {
    logProblem.value = null;
    void listLogs();
  }, [state]);
  return (
    <Dialog title={strings.title} testid="log-dialog" onClose={onClose}>
      {log.value?.state === "running" ? <Running log={log.value} /> : <Start />}
      <Note>{logProblem.value}</Note>
      <Files />
    </Dialog>
  );
}

const SCALE = 100;

function Running({ log }: { log: LogState }) {
  const share = Math.min(1, log.bytes / Math.max(1, log.limit_bytes));
  return (
    <section class="log-running" data-testid="log-running">
      <div class="log-line">
        <span class="k-intent">●</span>
        <b>{strings.running(log.name ?? "")}</b>
        <span class="grow" />
        <Button look="primary" live testid="log-stop" onClick={() => void stopLog()}>
          {strings.stop}
        </Button>
      </div>
      <svg
        class="log-scale"
        viewBox={`0 0 ${SCALE} 12`}
        preserveAspectRatio="none"
        width="100%"
        height="12"
        aria-hidden="true"
      >
        <path d={ticks()} stroke="var(--edge)" stroke-width="1" vector-effect="non-scaling-stroke" />
        <path d={`M0 10H${share * SCALE}`} stroke="var(--ink)" stroke-width="4" />
        <path
          d={`M${SCALE} 0V12`}
          stroke="var(--limit)"
          stroke-width="4"
          vector-effect="non-scaling-stroke"
        />
      </svg>
      <p class="small second" data-testid="log-progress">
        {strings.progress(size(log.bytes), size(log.limit_bytes))},{" "}
        {strings.frames(grouped(log.frames), grouped(log.dropped))}
        {log.started_at !== null && `, ${strings.since(clock(log.started_at))}`}
      </p>
    </section>
  );
}

function ticks(): string {
  let path = "M0 7.5H100";
  for (let at = 0; at <= SCALE; at += 10) path += `M${at} 2V7.5`;
  return path;
}

function Start() {
  const format = useSignal<LogFormat>("candump");
  const name = useSignal("");
  const limit = useSignal(String(USUAL_MB));
  const busy = useSignal(false);
  const mb = parseNumber(limit.value, "MB") ?? 0;
  const wrong = mb < 1 || mb > MOST_MB;
  const start = async () => {
    if (wrong || busy.peek()) return;
    busy.value = true;
    await startLog(format.peek(), name.peek().trim() === "" ? null : name.peek().trim(), mb);
    busy.value = false;
  };
  return (
    <form
      class="log-form"
      onSubmit={event => {
        event.preventDefault();
        void start();
      }}
    >
      {log.value && <Ended log={log.value} />}
      <div class="entry beside">
        <span>{strings.format}</span>
        <Segments<LogFormat>
          label={strings.format}
          chosen={format.value}
          onChoose={key => {
            format.value = key;
          }}
          options={FORMATS.map(key => ({ key, label: strings.formats[key][0] }))}
        />
      </div>
      <p class="small second under">{strings.formats[format.value][1]}</p>
      <TextField label={strings.name} hint={strings.nameHint} at={name} beside testid="log-name" />
      <div class="log-line">
        <TextField
          label={strings.limit}
          at={limit}
          number
          unit={strings.limitUnit}
          beside
          short
          error={wrong && strings.limitWrong(limit.value.trim() || "–")}
          testid="log-limit"
        />
        <span class="grow" />
        <Button
          look="primary"
          live
          testid="log-start"
          disabled={wrong || busy.value || !connected.value}
          onClick={() => void start()}
        >
          {busy.value ? strings.starting : strings.start}
        </Button>
      </div>
      {!connected.value && <p class="small second under">{strings.noBus}</p>}
    </form>
  );
}

function Ended({ log }: { log: LogState }) {
  const name = log.name ?? "";
  switch (log.state) {
    case "stopped":
      return (
        <p class="log-ended" role="status">
          <Glyph kind="ok" /> {strings.ended.stopped(name, size(log.bytes))}
        </p>
      );
    case "full":
    case "failed":
      return (
        <p class="log-ended" role="status">
          <Glyph kind={log.state === "full" ? "notice" : "failure"} />
          <span>
            {log.state === "full" ? strings.ended.full(name, size(log.bytes)) : strings.ended.failed(name)}
            {log.reason !== null && ` ${noteText(log.reason, log.reason_code, log.reason_params)}`}
          </span>
        </p>
      );
    default:
      return null;
  }
}

function Files() {
  const list = logs.value;
  if (list === null) return null;
  return (
    <section class="log-files" data-testid="log-files">
      <h3>{strings.files}</h3>
      {list.length === 0 && <p class="second">{strings.noFiles}</p>}
      <ul>
        {list.map(one => (
          <File key={one.name} one={one} />
        ))}
      </ul>
    </section>
  );
}

function File({ one }: { one: LogFile }) {
  const confirming = useSignal(false);
  const running = log.value?.state === "running" && log.value.name === one.name ? log.value : null;
  return (
    <li class="log-file" data-testid={`log-${one.name}`}>
      <span class="log-name">
        <span class="mono">{one.name}</span>
        <small>
          {size(running?.bytes ?? one.bytes)},{" "}
          {running ? strings.being : `${date(one.modified_at)} ${minute(one.modified_at)}`}
        </small>
      </span>
      {confirming.value ? (
        <>
          <span class="small">{strings.confirmRemoval}</span>
          <Button look="danger" live testid="log-remove-yes" onClick={() => void removeLog(one.name)}>
            {strings.removeYes}
          </Button>
          <Button
            onClick={() => {
              confirming.value = false;
            }}
          >
            {strings.removeNo}
          </Button>
        </>
      ) : (
        <>
          <a class="button" href={urlOf(one.name)} download={one.name} data-testid="log-download">
            <Icon name="download" size={15} />
            {strings.download}
            <span class="hidden-text">{one.name}</span>
          </a>
          <Button
            live
            disabled={running !== null}
            testid="log-remove"
            onClick={() => {
              confirming.value = true;
            }}
          >
            {strings.remove}
          </Button>
        </>
      )}
    </li>
  );
}
