/** Marker at the left of a row: its state as a shape. */

import type { RowState } from "../bench/row-state";
import { Glyph } from "../kit/glyph";
import { Icon, Spinner } from "../kit/icon";

export function Marker({ state }: { state: RowState }) {
  switch (state) {
    case "staged":
      return <span class="dot k-intent">●</span>;
    case "pending":
      return (
        <span class="k-intent">
          <Spinner />
        </span>
      );
    case "applied":
      return (
        <span class="k-intent">
          <Icon name="half" size={16} />
        </span>
      );
    case "saved":
      return (
        <span class="k-ok">
          <Icon name="tick" size={16} />
        </span>
      );
    case "failed":
    case "out_of_range":
    case "invalid":
      return <Glyph kind="failure" size={13} />;
    case "clamped":
      return <Glyph kind="warning" size={15} />;
    case "no_effect":
      return (
        <span class="dim">
          <Icon name="none" size={16} />
        </span>
      );
    case "stale":
      return <span class="dim">–</span>;
    case "idle":
      return null;
  }
}
