"""Several servers as one service: PostgreSQL, HAProxy, and two servers of which one is killed. tools/service_cluster is the long form."""
import signal
import sys
import unittest

import cluster
import harness


class OfTwoServers(harness.InFolder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.maps = cluster.make_maps(cls.folder)
        cls.cluster = cluster.Cluster(cls.folder)
        cls.addClassCleanup(cls.cluster.end)
        cls.images, cls.camera = cluster.images_of("query_around", cls.folder, 0, 60, 6), cluster.camera_of("query_around")
        cls.truths = {}
        for path in reversed(cls.maps):
            cls.cluster.put("desk", path)
            digest, positions = cluster.truth_of(cls.cluster.haproxy.client(), "desk", cls.images, cls.camera)
            assert sum(p is not None for p in positions) > len(positions) / 2, positions
            cls.truths[digest] = positions
        assert len(cls.truths) == 2

    def load(self, clients=4):
        load = cluster.Load(self.cluster.haproxy.client, "desk", self.images, self.camera, clients)
        load.truths = self.truths
        return load

    def test_a_killed_server_costs_no_answer(self):
        with self.load() as load:
            _, failures = cluster.kill_a_server(self.cluster, load, 40)
        self.assertEqual(failures, [])
        self.assertEqual(load.mixtures(), [])

    def test_websockets_go_on_at_the_other_server(self):
        victim = self.cluster.servers[0]
        before = [cluster.track(self.cluster.haproxy, "desk") for _ in range(4)]
        self.addCleanup(lambda: [connection.close() for connection, _ in before])
        victim.end(signal.SIGKILL)
        self.addCleanup(victim.start)
        for _ in before:
            connection, hello = cluster.track(self.cluster.haproxy, "desk")
            connection.close()
            self.assertEqual((hello["type"], hello["map"]), ("hello", "desk"))
            self.assertIn(hello["digest"], self.truths)

    def test_a_map_is_replaced_under_load(self):
        with self.load() as load:
            cluster.replace_the_map(self.cluster, load, self.maps, 4, 40)
        self.assertEqual(load.failures(), [])
        self.assertEqual(load.mixtures(), [])
        self.assertEqual(load.digests(), set(self.truths))

    def test_the_database_is_gone_for_a_while(self):
        with self.load() as load:
            slowest = cluster.break_the_database(self.cluster, load, 3)
        self.assertLess(slowest, 20)  # what needs the database is refused, and does not hang
        self.assertEqual(load.failures(), [])
        self.assertEqual(load.mixtures(), [])


if __name__ == "__main__":
    if cluster.missing():
        print("skipped: there is no " + ", no ".join(cluster.missing()))
        sys.exit(77)
    unittest.main(verbosity=2)
