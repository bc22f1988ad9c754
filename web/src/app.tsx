/** Owns the frame: what stands round every page, and which page is inside. */
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { MotionPage } from "./pages/motion";
import { ParametersPage } from "./pages/parameters";
import { ServosPage } from "./pages/servos";
import { onKey } from "./state/keys";
import { link } from "./state/link";
import { route } from "./state/route";
import { Bands } from "./ui/bands";
import { TopBar } from "./ui/bar";
import { Foot } from "./ui/foot";
import { KeysHelp } from "./ui/keys-help";
import { Rail } from "./ui/rail";

export function App() {
  const help = useSignal(false);
  useEffect(() => {
    const open = () => {
      help.value = true;
    };
    return onKey("?", open);
  }, [help]);
  return (
    <div class="frame" data-link={link.value.state}>
      <TopBar />
      <Bands />
      <Rail
        onKeys={() => {
          help.value = true;
        }}
      />
      <main>
        <Page />
      </main>
      <Foot />
      {help.value && (
        <KeysHelp
          onClose={() => {
            help.value = false;
          }}
        />
      )}
    </div>
  );
}

function Page() {
  const { page, uid, hash } = route.value;
  if (page === "parameters" && uid) return <ParametersPage key={uid} uid={uid} hash={hash} />;
  if (page === "motion" && uid) return <MotionPage key={uid} uid={uid} />;
  return <ServosPage />;
}
