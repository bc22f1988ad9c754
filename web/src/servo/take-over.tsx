/** The Motion page while another client has motion control: request it, wait, or take it with a reason. */
import { useSignal } from "@preact/signals";
import { now } from "../bench/clock";
import { who } from "../bench/holder";
import { forgetMotion, leaseOfOther, motion } from "../bench/motion";
import { Button } from "../kit/button";
import { Dialog, Quit } from "../kit/dialog";
import { Glyph } from "../kit/glyph";
import { Spinner } from "../kit/icon";
import { text } from "../text";
import { forceControl, requestControl } from "./take-over-state";
import { takeOver as words } from "./words";
import "./take-over.css";

export function TakeOver({ uid }: { uid: string }) {
  const reason = useSignal("");
  const taking = useSignal(false);
  const present = motion.value;
  if (present.phase === "held") {
    return (
      <section class="take-over" data-testid="take-over" data-phase="held">
        <h3>
          <span class="k-intent">●</span> {words.yours}
        </h3>
        <p class="second">{words.yoursText}</p>
        <Button testid="give-back" onClick={() => forgetMotion(null)}>
          {words.release}
        </Button>
      </section>
    );
  }
  const held = leaseOfOther(uid);
  const waiting = present.phase === "waiting" ? present : null;
  const holder = who(held?.holder ?? waiting?.from ?? "");
  const close = () => {
    taking.value = false;
  };
  return (
    <section class="take-over" data-testid="take-over" data-phase={present.phase}>
      <h3>
        {waiting ? <Spinner /> : <Glyph kind="warning" />}{" "}
        {waiting ? words.requested(holder) : words.held(holder)}
      </h3>
      <p class="second" data-testid="take-over-left">
        {waiting
          ? words.passes(waiting.endsAt - now.value)
          : words.left((held?.endsAt ?? now.value) - now.value)}
      </p>
      {!waiting && <Reason label={words.why} testid="request-reason" reason={reason} />}
      <div class="take-over-buttons">
        {waiting ? (
          <Button testid="request-withdraw" onClick={() => forgetMotion(null)}>
            {words.withdraw}
          </Button>
        ) : (
          <Button
            look="primary"
            testid="request-lease"
            live
            disabled={present.phase !== "off"}
            onClick={() => void requestControl(uid, reason.value)}
          >
            {words.request}
          </Button>
        )}
        <Button
          look="danger"
          testid="take-lease"
          live
          disabled={present.phase === "requesting"}
          onClick={() => {
            taking.value = true;
          }}
        >
          {words.take}
        </Button>
      </div>
      {taking.value && (
        <Dialog
          title={words.takeTitle(holder)}
          testid="take-dialog"
          onClose={close}
          foot={
            <>
              <Quit onClose={close} word={text.cancel} />
              <Button
                look="danger"
                testid="take-now"
                live
                disabled={reason.value.trim() === ""}
                onClick={() => {
                  close();
                  void forceControl(uid, reason.value);
                }}
              >
                {words.takeNow}
              </Button>
            </>
          }
        >
          <p>{words.takeText(holder)}</p>
          <Reason label={words.takeWhy} testid="take-reason" reason={reason} />
          {reason.value.trim() === "" && <p class="small second">{words.takeNeeds}</p>}
        </Dialog>
      )}
    </section>
  );
}

function Reason({ label, testid, reason }: { label: string; testid: string; reason: { value: string } }) {
  return (
    <label class="take-over-why">
      <span class="second small">{label}</span>
      <input
        class="field"
        type="text"
        maxLength={200}
        autocomplete="off"
        data-testid={testid}
        value={reason.value}
        onInput={event => {
          reason.value = event.currentTarget.value;
        }}
      />
    </label>
  );
}
