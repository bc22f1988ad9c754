/** The values of a servo for a page that shows them: read after each connection, restart and identification. */
import { useEffect } from "preact/hooks";
import { servo } from "../bench/fleet";
import { connection } from "../bench/link";
import { type Sheet, sheetOf } from "../bench/parameters";

export function useSheet(uid: string): Sheet {
  const sheet = sheetOf(uid);
  const one = servo(uid);
  const round = connection.value;
  const ready = one?.online === true && one.state !== "identifying" && one.state !== "restarting";
  useEffect(() => {
    if (round > 0) void sheet.load();
  }, [uid, round, ready]);
  return sheet;
}
