// What page and viewer tell each other.
import type { ChunkData } from "../../pkg/mte_slam_web.js";
import type { Vec3 } from "./math";

export type Shading = "color" | "class" | "normal" | "depth";

export interface Theme {
  background: Vec3;
  grid: Vec3;
  path: Vec3;
  truth: Vec3;
  dark: boolean;
}

export type ViewMessage =
  | { type: "canvas"; canvas: OffscreenCanvas }
  | { type: "size"; width: number; height: number }
  | { type: "theme"; theme: Theme }
  | { type: "reset" }
  | { type: "chunks"; chunks: ChunkData[]; bounds: number[] | null }
  | { type: "path"; positions: Uint8Array }
  | { type: "truth"; positions: Uint8Array }
  | { type: "pose"; worldFromCamera: number[]; aspect: number; focal: number }
  | { type: "shading"; shading: Shading }
  | { type: "classes"; colors: Uint8Array; visible: boolean[]; highlight: number }
  | { type: "orbit"; dx: number; dy: number }
  | { type: "pan"; dx: number; dy: number }
  | { type: "zoom"; factor: number }
  | { type: "follow"; on: boolean }
  | { type: "truthShown"; on: boolean }
  | { type: "fit" }
  | { type: "pick"; id: number; x: number; y: number }
  | { type: "stats"; id: number };

export type ViewEvent =
  | { type: "ready" }
  | { type: "unsupported"; message: string }
  | { type: "lost" }
  /** The context came back, empty. */
  | { type: "restored" }
  | { type: "followed"; on: boolean }
  | { type: "picked"; id: number; hit: { class: number; point: Vec3 } | null }
  | {
      type: "stats";
      id: number;
      triangles: number;
      chunks: number;
      /** Share of the picture that is not background. */
      covered: number;
      /** Pictures drawn since the start. */
      frames: number;
      /** Mean red, green and blue of the picture, 0..255. */
      mean: Vec3;
      eye: Vec3;
      bytes: number;
    };
