/** CSV of samples: exactly a part of time, gaps empty, and what was written is read again. */
import { describe, expect, test } from "vitest";
import { fromCsv, toCsv } from "./csv";
import { TelemetryStore } from "./store";

function filled(): TelemetryStore {
  const store = new TelemetryStore();
  store.utcOffset = 1_700_000_000;
  store.push("a", "x", [10, 11, 12, 13], [1, null, 3.5, 4], 0);
  store.push("a", "y", [11, 12], [5, 6], 0);
  return store;
}

const columns = [
  { uid: "a", channel: "x", head: "x" },
  { uid: "a", channel: "y", head: "y" },
];

describe("toCsv", () => {
  test("has one row a time of exactly the part that is seen, both ends included, gaps empty", () => {
    expect(toCsv(filled(), columns, 10.5, 12).split("\r\n")).toEqual([
      "t_utc,t_s,x,y",
      "2023-11-14T22:13:31.000Z,11.000000,,5",
      "2023-11-14T22:13:32.000Z,12.000000,3.5,6",
      "",
    ]);
  });

  test("a name that a spreadsheet would run, or that has a comma, is text", () => {
    const heads = [{ uid: "a", channel: "x", head: '=1+1,"arm"/x' }];
    expect(toCsv(filled(), heads, 10, 10).split("\r\n")[0]).toBe('t_utc,t_s,"\'=1+1,""arm""/x"');
  });
});

describe("fromCsv", () => {
  test("reads what was written", () => {
    const found = fromCsv(toCsv(filled(), columns, 0, 20));
    expect(found?.columns.map(one => [one.head, [...one.t], [...one.v]])).toEqual([
      ["x", [10, 12, 13], [1, 3.5, 4]],
      ["y", [11, 12], [5, 6]],
    ]);
    expect(found?.utcOffset).toBeCloseTo(1_700_000_000, 3);
  });

  test("reads names with commas, and leaves out what is no sample or goes back in time", () => {
    const found = fromCsv('t_s,"L, left/x"\n1,2\nrubbish\n0.5,9\n2,\n3,x\n4,7\n');
    expect(found?.columns).toHaveLength(1);
    expect(found?.columns[0]?.head).toBe("L, left/x");
    expect([...(found?.columns[0]?.t ?? [])]).toEqual([1, 4]);
  });

  test("is null for a file that is no telemetry, or has no sample", () => {
    expect(fromCsv("a,b\n1,2\n")).toBeNull();
    expect(fromCsv("")).toBeNull();
    expect(fromCsv("t_s,x\n")).toBeNull();
  });
});
