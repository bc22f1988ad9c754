/** What rows and tabs are about, in the page's language; the server's words where it has none. */
import type { Row } from "../api/types";
import type { Tab } from "./catalog";
import { help } from "./words";

export const aboutRow = (row: Row) => help.rows[row.key] ?? row.description;

export const aboutTab = (tab: Tab) => help.groups[tab.key] ?? tab.description;

/** What the maker advises on a row, if anything. */
export const adviceOn = (row: Row) => help.advice[row.key] ?? row.advice;
