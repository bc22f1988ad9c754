/** Owns parts of the page that come in files of their own: fetched when first shown, kept from then on. */
import { type Signal, signal } from "@preact/signals";
import type { ComponentType } from "preact";
import { useEffect } from "preact/hooks";
import { text } from "../text";
import { topicsLoaded } from "../text/language";
import { Button } from "./button";

/** A component that is fetched by `load` when it is first shown. */
export function lazy<Props extends object>(load: () => Promise<ComponentType<Props>>): ComponentType<Props> {
  const found: Signal<ComponentType<Props> | null> = signal(null);
  const failed = signal(false);
  const fetchIt = () => {
    failed.value = false;
    topicsLoaded()
      .then(load)
      .then(
        component => {
          found.value = component;
        },
        () => {
          failed.value = true;
        },
      );
  };
  return function Fetched(props: Props) {
    useEffect(() => {
      if (found.peek() === null) fetchIt();
    }, []);
    const Component = found.value;
    if (Component) return <Component {...props} />;
    if (!failed.value) return null;
    // Most likely hornbill was updated since this page was opened: its files have other names now.
    return (
      <p class="notice-line" role="alert">
        {text.lazy.failed} <Button onClick={() => location.reload()}>{text.lazy.reload}</Button>
      </p>
    );
  };
}
