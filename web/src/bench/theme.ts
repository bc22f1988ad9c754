/** Light, dark or auto: the wish, where it is kept, and what is shown. Paper is always light. */
import { computed, effect, signal } from "@preact/signals";

export type ThemeWish = "light" | "dark" | "auto";

const KEY = "hornbill.theme";
const system = matchMedia("(prefers-color-scheme: dark)");
const systemDark = signal(system.matches);
const paper = matchMedia("print");
const onPaper = signal(paper.matches);

function kept(): ThemeWish {
  try {
    const value = localStorage.getItem(KEY);
    return value === "light" || value === "dark" ? value : "auto";
  } catch {
    return "auto";
  }
}

export const themeWish = signal<ThemeWish>(kept());

export const theme = computed<"light" | "dark">(() => {
  if (onPaper.value) return "light";
  if (themeWish.value !== "auto") return themeWish.value;
  return systemDark.value ? "dark" : "light";
});

export function chooseTheme(next: ThemeWish): void {
  themeWish.value = next;
  try {
    localStorage.setItem(KEY, next);
  } catch {
    // Not kept then; the choice stands until the page is loaded again.
  }
}

export function startTheme(): void {
  system.addEventListener("change", event => {
    systemDark.value = event.matches;
  });
  paper.addEventListener("change", event => {
    onPaper.value = event.matches;
  });
  effect(() => {
    document.documentElement.dataset.theme = theme.value;
  });
}
