// SPDX-License-Identifier: GPL-2.0
/*
 * Trigger sources for tests, fired from user space through debugfs:
 *
 *   rig_triggers/pps    writing N is one assert of a PPS source at N ns of CLOCK_REALTIME, as a source with a time stamp
 *                       unit of its own would tell it; 1: now
 *   rig_triggers/extts  writing N is one external time stamp event on channel N of a PTP clock
 *
 * The PTP clock runs 37 s ahead of CLOCK_REALTIME, as TAI does, and can be set and shifted. With gpio_label= the
 * kernel's own pps-gpio driver is bound to a line of that GPIO chip.
 */
#include <linux/debugfs.h>
#include <linux/gpio/machine.h>
#include <linux/module.h>
#include <linux/platform_device.h>
#include <linux/pps_kernel.h>
#include <linux/property.h>
#include <linux/ptp_clock_kernel.h>
#include <linux/slab.h>
#include <linux/uaccess.h>

#define CHANNELS 2

static char *gpio_label;
module_param(gpio_label, charp, 0444);
static int gpio_line;
module_param(gpio_line, int, 0444);

static struct dentry *folder;
static struct pps_device *pps;
static struct ptp_clock *clock;
static struct platform_device *pps_gpio;
static struct gpiod_lookup_table *lookup;

static DEFINE_SPINLOCK(offset_lock);
static s64 offset_ns = 37LL * NSEC_PER_SEC;
static unsigned long enabled_channels;

static s64 clock_now(void)
{
	unsigned long flags;
	s64 offset;

	spin_lock_irqsave(&offset_lock, flags);
	offset = offset_ns;
	spin_unlock_irqrestore(&offset_lock, flags);
	return ktime_get_real_ns() + offset;
}

static void shift_clock(s64 by_ns)
{
	unsigned long flags;

	spin_lock_irqsave(&offset_lock, flags);
	offset_ns += by_ns;
	spin_unlock_irqrestore(&offset_lock, flags);
}

static int get_time(struct ptp_clock_info *info, struct timespec64 *time, struct ptp_system_timestamp *around)
{
	ptp_read_system_prets(around);
	*time = ns_to_timespec64(clock_now());
	ptp_read_system_postts(around);
	return 0;
}

static int set_time(struct ptp_clock_info *info, const struct timespec64 *time)
{
	shift_clock(timespec64_to_ns(time) - clock_now());
	return 0;
}

static int adjust_time(struct ptp_clock_info *info, s64 by_ns)
{
	shift_clock(by_ns);
	return 0;
}

static int adjust_rate(struct ptp_clock_info *info, long scaled_ppm)
{
	return 0;
}

static int enable(struct ptp_clock_info *info, struct ptp_clock_request *request, int on)
{
	if (request->type != PTP_CLK_REQ_EXTTS)
		return -EOPNOTSUPP;
	if (on)
		set_bit(request->extts.index, &enabled_channels);
	else
		clear_bit(request->extts.index, &enabled_channels);
	return 0;
}

static int verify_pin(struct ptp_clock_info *info, unsigned int pin, enum ptp_pin_function function, unsigned int channel)
{
	return function == PTP_PF_NONE || function == PTP_PF_EXTTS ? 0 : -1;
}

static struct ptp_pin_desc pins[CHANNELS] = {
	{ .name = "TRIG0", .index = 0 },
	{ .name = "TRIG1", .index = 1 },
};

static struct ptp_clock_info clock_info = {
	.owner = THIS_MODULE,
	.name = "rig triggers",
	.n_ext_ts = CHANNELS,
	.n_pins = CHANNELS,
	.pin_config = pins,
	.verify = verify_pin,
	.gettimex64 = get_time,
	.settime64 = set_time,
	.adjtime = adjust_time,
	.adjfine = adjust_rate,
	.enable = enable,
};

static struct pps_source_info pps_info = {
	.name = "rig triggers",
	.mode = PPS_CAPTUREASSERT | PPS_OFFSETASSERT | PPS_CANWAIT | PPS_TSFMT_TSPEC,
	.owner = THIS_MODULE,
};

static ssize_t fire_pps(struct file *file, const char __user *text, size_t size, loff_t *at)
{
	struct pps_event_time when;
	s64 real_ns;
	int error = kstrtos64_from_user(text, size, 0, &real_ns);

	if (error)
		return error;
	pps_get_ts(&when);
	if (real_ns > 1)
		when.ts_real = ns_to_timespec64(real_ns);
	pps_event(pps, &when, PPS_CAPTUREASSERT, NULL);
	return size;
}

static ssize_t fire_extts(struct file *file, const char __user *text, size_t size, loff_t *at)
{
	struct ptp_clock_event event = { .type = PTP_CLOCK_EXTTS, .timestamp = clock_now() };
	int error = kstrtoint_from_user(text, size, 0, &event.index);

	if (error)
		return error;
	if (event.index < 0 || event.index >= CHANNELS || !test_bit(event.index, &enabled_channels))
		return -ENXIO;
	ptp_clock_event(clock, &event);
	return size;
}

static const struct file_operations pps_file = { .owner = THIS_MODULE, .open = simple_open, .write = fire_pps };
static const struct file_operations extts_file = { .owner = THIS_MODULE, .open = simple_open, .write = fire_extts };

/* An entry without a name matches every name, so the optional "echo" line of pps-gpio has to come first. */
static int bind_pps_gpio(void)
{
	static const struct property_entry properties[] = { PROPERTY_ENTRY_U32("echo-active-ms", 10), {} };
	const struct platform_device_info info = {
		.name = "pps-gpio", .id = PLATFORM_DEVID_NONE, .properties = properties,
	};

	lookup = kzalloc(struct_size(lookup, table, 3), GFP_KERNEL);
	if (!lookup)
		return -ENOMEM;
	lookup->dev_id = "pps-gpio";
	lookup->table[0] = GPIO_LOOKUP(gpio_label, gpio_line + 1, "echo", GPIO_ACTIVE_HIGH);
	lookup->table[1] = GPIO_LOOKUP(gpio_label, gpio_line, NULL, GPIO_ACTIVE_HIGH);
	gpiod_add_lookup_table(lookup);
	pps_gpio = platform_device_register_full(&info);
	return PTR_ERR_OR_ZERO(pps_gpio);
}

static void tear_down(void)
{
	if (!IS_ERR_OR_NULL(pps_gpio))
		platform_device_unregister(pps_gpio);
	if (lookup) {
		gpiod_remove_lookup_table(lookup);
		kfree(lookup);
	}
	debugfs_remove_recursive(folder);
	if (!IS_ERR_OR_NULL(clock))
		ptp_clock_unregister(clock);
	if (!IS_ERR_OR_NULL(pps))
		pps_unregister_source(pps);
}

static int __init rig_triggers_init(void)
{
	int error = 0;

	pps = pps_register_source(&pps_info, PPS_CAPTUREASSERT | PPS_OFFSETASSERT);
	if (IS_ERR(pps))
		return PTR_ERR(pps);
	clock = ptp_clock_register(&clock_info, NULL);
	if (IS_ERR_OR_NULL(clock))
		error = clock ? PTR_ERR(clock) : -ENODEV;
	if (!error) {
		folder = debugfs_create_dir("rig_triggers", NULL);
		debugfs_create_file("pps", 0200, folder, NULL, &pps_file);
		debugfs_create_file("extts", 0200, folder, NULL, &extts_file);
		if (gpio_label)
			error = bind_pps_gpio();
	}
	if (error)
		tear_down();
	return error;
}
module_init(rig_triggers_init);

static void __exit rig_triggers_exit(void)
{
	tear_down();
}
module_exit(rig_triggers_exit);

MODULE_LICENSE("GPL");
MODULE_DESCRIPTION("Trigger sources for tests");
