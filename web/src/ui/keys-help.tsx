/** Owns the list of keys. */
import { text } from "../text/en";
import { Button } from "./button";
import { Dialog } from "./dialog";

export function KeysHelp({ onClose }: { onClose: () => void }) {
  return (
    <Dialog
      title={text.keys.title}
      onClose={onClose}
      testid="keys-dialog"
      foot={
        <span data-first-focus>
          <Button onClick={onClose}>{text.close}</Button>
        </span>
      }
    >
      <dl class="keys">
        {text.keys.list.map(([key, what]) => (
          <div key={key}>
            <dt>
              {key.split(" ").map(one => (
                <kbd key={one}>{one}</kbd>
              ))}
            </dt>
            <dd>{what}</dd>
          </div>
        ))}
      </dl>
    </Dialog>
  );
}
