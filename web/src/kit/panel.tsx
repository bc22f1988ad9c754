/** Error boundary: confines the failure of a panel to the panel. */
import { Component, type ComponentChildren } from "preact";
import { text } from "../text";
import { Button } from "./button";

interface Props {
  children: ComponentChildren;
}

interface State {
  why: string | null;
}

/** Renders its children; after an error, a message with a retry button. */
export class Panel extends Component<Props, State> {
  override state: State = { why: null };

  static override getDerivedStateFromError(error: unknown): State {
    return { why: error instanceof Error ? error.message : String(error) };
  }

  override componentDidCatch(error: unknown): void {
    // Also logged to the console.
    console.error(error);
  }

  override render() {
    const { why } = this.state;
    if (why === null) return this.props.children;
    return (
      <p class="notice-line" role="alert" data-testid="panel-failed">
        {text.panel.failed(why)}{" "}
        <Button onClick={() => this.setState({ why: null })}>{text.panel.again}</Button>
      </p>
    );
  }
}
