/** What the failure of a panel may take with it: that panel, and nothing else. */
import { Component, type ComponentChildren } from "preact";
import { text } from "../text";
import { Button } from "./button";

interface Props {
  children: ComponentChildren;
}

interface State {
  why: string | null;
}

/** Shows what is inside; when that cannot be drawn it says so in its place, with a way to try again. */
export class Panel extends Component<Props, State> {
  override state: State = { why: null };

  static override getDerivedStateFromError(error: unknown): State {
    return { why: error instanceof Error ? error.message : String(error) };
  }

  override componentDidCatch(error: unknown): void {
    // Caught is not hidden: whoever looks for the cause finds it in the console.
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
