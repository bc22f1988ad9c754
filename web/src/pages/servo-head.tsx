/** Owns the head of a servo's page: its horn, its name (which chooses another), its condition. */
import type { ComponentChildren } from "preact";
import { NONE } from "../form/format";
import { all, type KnownServo, nameOf } from "../state/fleet";
import { conditionHere } from "../state/here";
import { go, type Page, pathOf } from "../state/route";
import { text } from "../text";
import { Glyph } from "../ui/glyph";
import { Icon } from "../ui/icon";
import { LiveDial } from "./servo-row";

interface Props {
  one: KnownServo;
  page: Page;
  children?: ComponentChildren;
}

export function ServoHead({ one, page, children }: Props) {
  const condition = conditionHere(one);
  return (
    <header class="servo-page-head">
      <LiveDial one={one} size={56} />
      <div class="who">
        <ServoChoice one={one} page={page} />
        <small class="second">
          {text.params.facts(
            one.model ?? text.servos.unknownModel,
            one.serial ?? NONE,
            String(one.servo_id ?? NONE),
            String(one.node_id ?? NONE),
          )}
        </small>
      </div>
      <div class="how" data-testid="servo-state" data-kind={condition.kind} data-state={one.state}>
        <Glyph kind={condition.kind} />
        <span>
          <b>{condition.headline}</b>
          <small class={condition.alarming ? "k-failure strong" : "second"}>{condition.line}</small>
        </span>
      </div>
      <div class="head-right">{children}</div>
    </header>
  );
}

function ServoChoice({ one, page }: { one: KnownServo; page: Page }) {
  const others = all.value;
  if (others.length < 2) return <h1>{nameOf(one)}</h1>;
  return (
    <h1 class="choose">
      <label>
        <span class="hidden-text">{text.params.choose}</span>
        <select
          value={one.uid}
          data-testid="choose-servo"
          onChange={event => go(pathOf(page, event.currentTarget.value))}
        >
          {others.map(other => (
            <option key={other.uid} value={other.uid}>
              {nameOf(other)}
            </option>
          ))}
        </select>
        <span class="choose-face" aria-hidden="true">
          {nameOf(one)}
          <Icon name="down" size={16} />
        </span>
      </label>
    </h1>
  );
}
