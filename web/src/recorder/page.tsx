/** The Recorder page: state of the recorder, manual saving, the list of recordings, and an open recording. */

import { useSignal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { API, callApi, problemOf } from "../api/client";
import type { RecorderState, Recording } from "../api/lab-types";
import { events } from "../bench/bench";
import { markText } from "../bench/event-text";
import { problemText } from "../bench/facts";
import { age, grouped, number, size, withUnit } from "../bench/format";
import { connection } from "../bench/link";
import { noteText } from "../bench/note-text";
import { Resource } from "../bench/resource";
import { go, pathOf, wordInAddress } from "../bench/route";
import { Button } from "../kit/button";
import { Confirm } from "../kit/confirm";
import { FilePick, TextField } from "../kit/field";
import { Glyph } from "../kit/glyph";
import { Icon, Spinner } from "../kit/icon";
import { Done, Empty, instant } from "../kit/loaded";
import { Note } from "../kit/note";
import { Loaded, useResource } from "../kit/resource";
import { Scroll } from "../kit/scroll";
import { alsoMarked, isZip } from "../plots/recording";
import { text } from "../text";
import { Happened } from "./happened";
import { PlayDialog } from "./play";
import { RecordingView } from "./recording";
import { GLYPHS } from "./recording-glyph";
import { recorder as words } from "./words";
import "../kit/list.css";
import "./recorder.css";

const WRITTEN = new Set(["recording_written", "recordings_deleted", "recording_failed"]);
const LOOK_MS = 2000;
const CARRY_MS = 300_000;

/** Times of the event that "Show what happened" leads from, and the moment at which a recording opens. */
const from = wordInAddress("from");
const to = wordInAddress("to");
const at = wordInAddress("at");

export function RecorderPage({ hash }: { hash: string }) {
  return (
    <div class="page list-page" data-testid="recorder-page">
      {hash === "" ? (
        <Recordings />
      ) : (
        <RecordingView key={hash} name={hash} at={at.value === "" ? null : Number(at.value)} />
      )}
    </div>
  );
}

function Recordings() {
  const state = useMemo(() => new Resource<RecorderState>(() => callApi("GET", "/recorder")), []);
  const playing = useSignal<string | null>(null);
  const dropping = useSignal<string | null>(null);
  const note = useSignal<string | null>(null);
  const round = connection.value;
  // The event reports a recording when its file is complete, some time after the recorder has finished it.
  const written = events.value.find(one => WRITTEN.has(one.code))?.at;
  const list = useResource(() => callApi("GET", "/recorder/recordings"), { again: written });
  const load = () => void list.load();
  useEffect(() => state.watch(LOOK_MS).end, [round]);
  const found = list.value.value;
  return (
    <>
      <div class="page-head">
        <h1>{text.nav.recorder}</h1>
      </div>
      <Scroll label={text.nav.recorder} testid="recorder">
        <Loaded of={state} />
        <Head state={state} onNote={line => (note.value = line)} onNew={() => void load()} />
        {found !== null && state.value.value !== null && from.value !== "" && (
          <Happened
            of={{ from: Number(from.value), to: Number(to.value) }}
            recordings={found}
            state={state.value.value}
            onSave={() => void state.load()}
          />
        )}
        <Done note={note.value} />
        <Loaded of={list} />
        {found === null && list.problem.value === null && <p class="w-line second">{words.loading}</p>}
        {found?.length === 0 && (
          <Empty title={words.empty} guides={["record"]}>
            {words.emptyLine}
          </Empty>
        )}
        {found !== null && found.length > 0 && (
          <ul data-testid="recordings">
            {found.map(one => (
              <Line
                key={one.name}
                one={one}
                onPlay={() => {
                  playing.value = one.name;
                }}
                onDrop={() => {
                  note.value = null;
                  dropping.value = one.name;
                }}
              />
            ))}
          </ul>
        )}
        {playing.value !== null && (
          <PlayDialog
            name={playing.value}
            onClose={() => {
              playing.value = null;
            }}
          />
        )}
        {dropping.value !== null && (
          <DropDialog
            name={dropping.value}
            onClose={done => {
              if (done) note.value = words.dropped(dropping.peek() ?? "");
              dropping.value = null;
              if (done) void load();
            }}
          />
        )}
      </Scroll>
    </>
  );
}

interface HeadProps {
  state: Resource<RecorderState>;
  onNote: (line: string | null) => void;
  onNew: () => void;
}

function Head({ state, onNote, onNew }: HeadProps) {
  const reason = useSignal("");
  const busy = useSignal<"saving" | "carrying" | null>(null);
  const problem = useSignal<string | null>(null);
  const present = state.value.value;
  const save = async () => {
    busy.value = "saving";
    problem.value = null;
    onNote(null);
    try {
      const said = reason.peek().trim();
      await state.load(
        () =>
          callApi("POST", "/recorder/recordings", {
            body: said === "" ? {} : { reason: said },
          }) as Promise<RecorderState>,
      );
      if (state.problem.peek() === null) reason.value = "";
    } catch (error) {
      problem.value = problemText(problemOf(error));
    }
    busy.value = null;
  };
  const carry = async (file: File) => {
    problem.value = null;
    onNote(null);
    if (!isZip(file.name)) {
      problem.value = words.notZip(file.name);
      return;
    }
    busy.value = "carrying";
    try {
      const made = await callApi("PUT", "/recorder/recordings/{name}", {
        path: { name: file.name },
        file: { text: file, type: "application/zip" },
        timeout_ms: CARRY_MS,
      });
      onNote(words.uploaded(made.name));
      onNew();
    } catch (error) {
      problem.value = problemText(problemOf(error));
    }
    busy.value = null;
  };
  const pending = present?.pending ?? null;
  const also = pending === null ? [] : alsoMarked(pending);
  return (
    <div class="rec-head">
      <div class="rec-state">
        <Glyph kind={present?.recording === false ? "identifying" : "ok"} />
        <div>
          <p class="strong" data-testid="recorder-state">
            {present === null ? words.loading : words.reach(age(present.reach_s, 0))}
            {present !== null && (
              <span class="second plain">
                {text.comma}
                {words.memory(grouped(present.frames), size(present.bytes))}
              </span>
            )}
          </p>
          <p class="second">{present?.recording === false ? words.resting : words.lead}</p>
        </div>
      </div>
      <div class="rec-do">
        <TextField
          label={words.reason}
          hint={words.reasonPlace}
          at={reason}
          longest={200}
          beside
          class="rec-reason"
          testid="recording-reason"
        />
        <Button
          look="primary"
          live
          testid="recording-save"
          disabled={busy.value !== null || present?.recording !== true}
          onClick={() => void save()}
        >
          {words.save}
        </Button>
        <span class="grow" />
        <FilePick
          label={busy.value === "carrying" ? words.uploading : words.upload}
          accept=".zip,application/zip"
          busy={busy.value === "carrying"}
          disabled={busy.value !== null}
          testid="recording-file"
          onFile={file => void carry(file)}
        />
      </div>
      {pending && (
        <p class="rec-pending" role="status" data-testid="recording-pending">
          <Spinner />
          <span>
            {words.pending(markText(pending.marks[0] ?? pending), number(Math.ceil(pending.ready_in_s), 0))}
            {also.length > 0 && <> {words.also(also.join(text.comma))}</>}
          </span>
        </p>
      )}
      <Note testid="recorder-problem">{problem.value}</Note>
    </div>
  );
}

function Line({ one, onPlay, onDrop }: { one: Recording; onPlay: () => void; onDrop: () => void }) {
  const why = one.reason === null ? words.unreadable : (words.why[one.reason] ?? one.reason);
  const readable = one.reason !== null;
  const also = alsoMarked(one);
  const facts = [
    instant(one.at),
    one.seconds === null ? words.unknown : withUnit(number(one.seconds, 0), "s"),
    size(one.bytes),
    ...(one.marks.length > 1 ? [`${words.marks} ${one.marks.length}`] : []),
  ].join(", ");
  return (
    <li class="list-line" data-testid={`recording-${one.name}`}>
      <div class="list-head rec-line">
        <button
          type="button"
          class="list-open list-job"
          disabled={!readable}
          aria-label={words.openLabel(one.name)}
          onClick={() => go(pathOf("recorder", null, encodeURIComponent(one.name)))}
        >
          <Glyph kind={one.reason === null ? "failure" : (GLYPHS[one.reason] ?? "ok")} />
          <span class="grow">
            <span>
              <b>{why}</b>
              {one.text !== "" && (
                <>: {markText(one.marks[0] ?? { ...one, reason: one.reason ?? "manual" })}</>
              )}
            </span>
            <small>
              {one.problem == null ? facts : noteText(one.problem, "problem", one.problem_params)}
            </small>
            {also.length > 0 && <small>{words.also(also.join(text.comma))}</small>}
            {one.problem != null && <small>{`${one.name}, ${size(one.bytes)}`}</small>}
          </span>
        </button>
        <a
          class="button"
          href={`${API}/recorder/recordings/${encodeURIComponent(one.name)}`}
          download=""
          aria-label={words.downloadLabel(one.name)}
        >
          <Icon name="download" size={15} /> {words.download}
        </a>
        <Button live testid={`play-${one.name}`} disabled={!readable} onClick={onPlay}>
          <Icon name="play" size={15} /> {words.play}
        </Button>
        <Button
          look="plain"
          live
          testid={`drop-${one.name}`}
          title={words.dropLabel(one.name)}
          onClick={onDrop}
        >
          {words.drop}
        </Button>
      </div>
    </li>
  );
}

function DropDialog({ name, onClose }: { name: string; onClose: (done: true | null) => void }) {
  return (
    <Confirm
      title={words.dropTitle}
      subtitle={words.dropText(name)}
      verb={words.dropConfirm}
      danger
      testid="drop-recording"
      actId="drop-recording-confirm"
      act={() =>
        callApi("DELETE", "/recorder/recordings/{name}", { path: { name } }).then(() => true as const)
      }
      onClose={onClose}
    />
  );
}
