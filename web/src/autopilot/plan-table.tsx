/** The outputs of the plan, editable. */
import type { AutopilotProgram } from "../api/autopilot-types";
import { all, nameOf } from "../bench/fleet";
import { parseNumber, wholeNumber } from "../bench/number";
import { Button } from "../kit/button";
import { type Column, DataTable } from "../kit/data-table";
import { cell, TextField, Tick } from "../kit/field";
import { Empty } from "../kit/loaded";
import { editOutput, IDS, type OutputDraft, removeOutput, rows } from "./plan";
import { autopilotWords as words } from "./words";

export function PlanTable({ program }: { program: AutopilotProgram }) {
  if (rows.value === null) return <p class="notice-line">{words.loading}</p>;
  return (
    <DataTable
      label={words.outputs}
      testid="plan-table"
      rows={rows.value}
      id={one => one.output}
      data={one => ({ testid: `plan-${one.output}` })}
      empty={<Empty title={words.noOutputs}>{words.noOutputsLine(...IDS[program])}</Empty>}
      columns={columns()}
    />
  );
}

type Angle = "low" | "neutral" | "high";

function columns(): readonly Column<OutputDraft>[] {
  const angleColumn = (key: Angle): Column<OutputDraft> => ({
    key,
    head: words.head[key],
    cell: one => (
      <TextField
        label={words.field(words.head[key], one.output)}
        bare
        short
        number
        unit="°"
        testid={`plan-${key}-${one.output}`}
        error={parseNumber(one[key], "°") === null}
        at={cell(one[key], typed => editOutput(one.output, { [key]: typed }))}
      />
    ),
  });
  return [
    { key: "output", head: words.head.output, cell: one => one.output },
    { key: "servo", head: words.head.servo, name: true, cell: one => <PlannedServo one={one} /> },
    angleColumn("low"),
    angleColumn("neutral"),
    angleColumn("high"),
    {
      key: "reversed",
      head: words.head.reversed,
      cell: one => (
        <Tick
          label={words.field(words.head.reversed, one.output)}
          bare
          testid={`plan-reversed-${one.output}`}
          at={cell(one.reversed, on => editOutput(one.output, { reversed: on }))}
        />
      ),
    },
    {
      key: "function",
      head: words.head.function,
      cell: one => (
        <TextField
          label={words.field(words.head.function, one.output)}
          bare
          short
          number
          hint={words.functionHint}
          testid={`plan-function-${one.output}`}
          error={one.function.trim() !== "" && wholeNumber(one.function) === null}
          at={cell(one.function, typed => editOutput(one.output, { function: typed }))}
        />
      ),
    },
    {
      key: "remove",
      head: words.head.remove,
      bare: true,
      right: true,
      cell: one => (
        <Button
          testid={`plan-remove-${one.output}`}
          label={words.remove(one.output)}
          onClick={() => removeOutput(one.output)}
        >
          ×
        </Button>
      ),
    },
  ];
}

function PlannedServo({ one }: { one: OutputDraft }) {
  const found = all.value.find(each => each.online && each.servo_id === one.servo_id);
  return (
    <>
      <b>{found ? nameOf(found) : one.label || words.id(one.servo_id)}</b>
      <small>
        {words.id(one.servo_id)}
        {!found && `. ${words.noServo}`}
      </small>
    </>
  );
}
