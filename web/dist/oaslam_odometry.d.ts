export type Camera = {
    /**
     * pixels
     */
    width: number;
    /**
     * pixels
     */
    height: number;
    /**
     * pixels
     */
    fx: number;
    /**
     * pixels
     */
    fy: number;
    /**
     * pixels
     */
    cx: number;
    /**
     * pixels
     */
    cy: number;
    /**
     * pinhole where it is left out
     */
    model?: "pinhole" | "fisheye";
    /**
     * pinhole: k1 k2 p1 p2 k3, fisheye: k1 k2 k3 k4; zeros where they are left out
     */
    distortion?: number[];
};
export type State = "preliminary" | "tracking" | "uncertain" | "inertial" | "blind";
export type Pose = {
    /**
     * a unit quaternion: x, y, z, w
     */
    rotation: Float64Array;
    /**
     * in the odometry's unit
     */
    translation: Float64Array;
};
export type Estimate = {
    state: State;
    /**
     * counts the interruptions: nothing is known of how poses of different runs lie to each other
     */
    run: number;
    /**
     * counted since the run began
     */
    image: number;
    /**
     * null where the state is blind
     */
    camFromOdom: Pose | null;
    /**
     * 6 x 6, of a small motion of the camera (translation, rotation vector in rad; its axes); zeros while the state is preliminary
     */
    covariance: Float64Array;
    /**
     * x and y in pixels and inverse depth, of each point in the image whose depth is known to a third
     */
    points: Float32Array;
    /**
     * of the keyframes that the odometry still corrects, as they are known with this image, 8 numbers each, by image,
     * ascending: image, position (x, y, z) and rotation (a unit quaternion: x, y, z, w) of the camera in the odometry's frame; none while the state is preliminary
     */
    keyframes: Float64Array;
    /**
     * whether this image is one
     */
    keyframe: boolean;
    /**
     * points that were followed into the image
     */
    tracked: number;
    /**
     * of them, those that agree with the pose
     */
    inliers: number;
    /**
     * the length of the odometry's unit, by the accelerations; null while it is not known
     */
    metresPerUnit: number | null;
    /**
     * its standard deviation, divided by it
     */
    metreSigma: number | null;
    /**
     * m/s2, along the camera's axes, pointing down, by the accelerations; null while it is not known
     */
    gravity: Float64Array | null;
};
export type Features = {
    count: number;
    /**
     * size of a pixel of the pyramid's lowest level, in pixels of the image
     */
    lowest: number;
    /**
     * of the pyramid
     */
    levels: number;
    /**
     * scale between two levels
     */
    factor: number;
    /**
     * of all x and y in the image without distortion and the angle in rad (float32, little-endian), then of all the level (a byte), then of
     * all the descriptors (32 bytes)
     */
    bytes: Uint8Array;
};
export declare class Odometry {
    #private;
    /**
     * Loads the module, once for all, and begins. Rejects with an Error that names key, value and bound of a camera that is refused.
     * @param {object} options
     * @param {Camera} options.camera
     * @param {number} [options.seed] of the random samples: a whole number
     * @param {URL | string | WebAssembly.Module} [options.wasm] by default oaslam_odometry.wasm beside this file
     * @returns {Promise<Odometry>}
     */
    static create({ camera, seed, wasm }: {
        camera: Camera;
        seed?: number;
        wasm?: URL | string | WebAssembly.Module;
    }): Promise<Odometry>;
    /**
     * The pose of the next image. Throws an Error for an image of another size and a time stamp that is not after the one before, which change nothing.
     * @param {Uint8Array | Uint8ClampedArray | ImageData} image width * height grey bytes, or an ImageData of that size
     * @param {number} timeSeconds of the exposure; ascends
     * @param {Iterable<ArrayLike<number>>} [samples] of a gyroscope, which ascend: time in seconds, and rad/s about the camera's x, y and z; those of an
     *   IMU have three numbers more, its acceleration along these axes in m/s2, with gravity: at rest 9.81 away from the ground.
     *   Those that an earlier image had already are ignored. Best are all up to a quarter of a second after the image.
     * @returns {Estimate}
     */
    process(image: Uint8Array | Uint8ClampedArray | ImageData, timeSeconds: number, samples?: Iterable<ArrayLike<number>>): Estimate;
    /**
     * Key points of the last image, as the program extracts them: by these a service finds the camera without the image.
     * @param {number} [count] about how many
     * @returns {Features}
     */
    features(count?: number): Features;
    /** Frees the memory. The last estimate must not be read any more; a second call does nothing. */
    delete(): void;
}
